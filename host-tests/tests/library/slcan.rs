//! CAN frames as lines: the published example, round trips, and damaged lines.

use embedded_can::{Frame, Id, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::slcan::{self, SlcanError};
use gyronet_host_tests::wire::{data_frame, id11, id29};

fn examples() -> [(DataFrame, &'static [u8]); 5] {
    let tx1 = [0xD0, 0x87, 0x00, 0x4B, 0x11, 0x83, 0x01, 0x00];
    [
        (data_frame(id11(0x174), &tx1), b"t1748D087004B11830100\r"),
        (data_frame(id11(0), &[]), b"t0000\r"),
        (data_frame(id11(0x7FF), &[0xA5]), b"t7FF1A5\r"),
        (data_frame(id29(0x18F0_0980), &[0x06, 0x83]), b"T18F0098020683\r"),
        (data_frame(id29(0x1FFF_FFFF), &[0xFF; 8]), b"T1FFFFFFF8FFFFFFFFFFFFFFFF\r"),
    ]
}

#[test]
fn examples_are_read_and_written() {
    for (frame, line) in examples() {
        assert_eq!(slcan::emit(&frame).as_deref(), Some(line));
        assert_eq!(slcan::parse(&line[..line.len() - 1]), Ok(frame));
        assert_eq!(
            slcan::parse(&line[..line.len() - 1].to_ascii_lowercase()).ok(),
            (line[0] == b't').then_some(frame)
        );
    }
}

#[test]
fn bad_lines_are_refused() {
    for (line, error) in [
        (&b""[..], SlcanError::Kind),
        (b"r1740", SlcanError::Kind),
        (b"t1g40", SlcanError::Digit { at: 2 }),
        (b"t17410x", SlcanError::Digit { at: 6 }),
        (b"t1+40", SlcanError::Digit { at: 2 }),
        (b"t1742AA", SlcanError::Length),
        (b"t1749112233445566778899", SlcanError::Length),
        (b"t8000", SlcanError::Identifier),
        (b"T200000000", SlcanError::Identifier),
    ] {
        assert_eq!(slcan::parse::<DataFrame>(line), Err(error), "{:?}", line.escape_ascii().to_string());
    }
}

/// A frame that no data line can carry.
struct Other {
    remote: bool,
    data: [u8; 12],
}

impl Frame for Other {
    fn new(_: impl Into<Id>, _: &[u8]) -> Option<Self> {
        None
    }
    fn new_remote(_: impl Into<Id>, _: usize) -> Option<Self> {
        None
    }
    fn is_extended(&self) -> bool {
        false
    }
    fn is_remote_frame(&self) -> bool {
        self.remote
    }
    fn id(&self) -> Id {
        Id::Standard(StandardId::ZERO)
    }
    fn dlc(&self) -> usize {
        self.data().len()
    }
    fn data(&self) -> &[u8] {
        if self.remote { &[] } else { &self.data }
    }
}

#[test]
fn what_is_no_classic_data_frame_gives_no_line() {
    assert_eq!(slcan::emit(&Other { remote: true, data: [0; 12] }), None);
    assert_eq!(slcan::emit(&Other { remote: false, data: [0; 12] }), None);
    assert_eq!(slcan::parse::<Other>(b"t1740").err(), Some(SlcanError::Length), "its driver refuses it");
    assert_eq!(DataFrame::new(StandardId::ZERO, &[0; 9]), None);
    assert_eq!(DataFrame::new_remote(StandardId::ZERO, 0), None);
}
