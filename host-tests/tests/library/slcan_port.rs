//! The board's end of an SLCAN line, over a line that takes what it likes.

use super::line::Line;
use embedded_can::Frame;
use gyronet::can::slcan::host::StatusFlags;
use gyronet::can::slcan::port::Port;
use gyronet::can::{DataFrame, slcan};
use gyronet::units::Micros;
use gyronet_host_tests::wire::{data_frame, id11};
use proptest::prelude::*;

/// The number of frames that may wait, as in the image.
const QUEUE: usize = 32;

fn frame(number: u64) -> DataFrame {
    data_frame(id11(0x174), &number.to_le_bytes())
}

/// The lines as a host splits them: CR ends a line, BEL is an answer of its own.
fn texts(sent: &[u8]) -> impl Iterator<Item = &[u8]> {
    sent.split(|byte| [b'\r', 7].contains(byte))
}

fn frames(sent: &[u8]) -> Vec<DataFrame> {
    texts(sent).filter_map(|line| slcan::parse(line).ok()).collect()
}

#[test]
fn commands_are_answered_between_frames() {
    let mut port = Port::<QUEUE>::new(500_000);
    let mut line = Line::of_room(10);
    port.enqueue(frame(1), Micros(0));
    port.enqueue(frame(2), Micros(1_234_000));
    port.service(&mut line, |_| true).expect("the line holds");
    line.receive(b"V\rZ1\rt0AA21A6F\r");
    line.room = 1_000;
    let mut taken = Vec::new();
    port.service(&mut line, |frame| {
        taken.push(frame);
        true
    })
    .expect("the line holds");
    assert_eq!(
        line.sent.escape_ascii().to_string(),
        "t17480100000000000000\\rV0101\\r\\r\\rt1748020000000000000004D2\\r"
    );
    assert_eq!(taken.len(), 1);
    assert_eq!(taken[0].data(), [0x1A, 0x6F]);
}

#[test]
fn the_bus_state_is_reported_beside_drops() {
    let mut port = Port::<1>::new(500_000);
    let mut line = Line::of_room(1_000);
    port.set_bus(StatusFlags(StatusFlags::BUS_ERROR.0 | StatusFlags::ERROR_PASSIVE.0));
    (0..2).for_each(|number| port.enqueue(frame(number), Micros(0)));
    line.receive(b"F\rF\r");
    port.service(&mut line, |_| true).expect("the line holds");
    // The drop once, the bus as long as it is off.
    assert!(line.sent.starts_with(b"FA2\rFA0\r"), "{}", line.sent.escape_ascii());
    port.set_bus(StatusFlags::default());
    line.sent.clear();
    line.receive(b"F\r");
    port.service(&mut line, |_| true).expect("the line holds");
    assert_eq!(line.sent, b"F00\r");
}

#[test]
fn drops_are_reported_once() {
    let mut port = Port::<2>::new(500_000);
    let mut line = Line::default();
    for number in 0..5 {
        port.enqueue(frame(number), Micros(0));
    }
    line.receive(b"F\rF\r");
    line.room = 1_000;
    port.service(&mut line, |_| true).expect("the line holds");
    assert!(line.sent.starts_with(b"F02\rF00\r"), "{}", line.sent.escape_ascii());
    assert_eq!(frames(&line.sent), [frame(3), frame(4)]);
    // A host that asks and never reads: no torn answer, no growth, and it is counted.
    line.room = 0;
    line.receive(&b"V\r".repeat(1_000));
    while !line.is_read() {
        port.service(&mut line, |_| true).expect("the line holds");
    }
    line.room = usize::MAX;
    line.sent.clear();
    port.service(&mut line, |_| true).expect("the line holds");
    let answers = line.sent.len() / 6;
    assert_eq!(line.sent, b"V0101\r".repeat(answers));
    assert_eq!(port.refused() as usize, 1_000 - answers);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the line does: lines are whole and in order, and every frame is accounted for.
    #[test]
    fn nothing_is_torn_and_nothing_lost_unseen(
        turns in proptest::collection::vec((0..4_u64, 0..60_usize, any::<bool>(), "[VNFO\r]{0,6}"), 0..80),
    ) {
        let mut port = Port::<4>::new(500_000);
        let (mut line, mut number) = (Line::default(), 0);
        for (pushes, room, broken, said) in turns {
            for _ in 0..pushes {
                port.enqueue(frame(number), Micros(0));
                number += 1;
            }
            line.receive(said.as_bytes());
            (line.room, line.broken) = (room, broken);
            let before = line.sent.len();
            let _ = port.service(&mut line, |_| true);
            prop_assert!(line.sent.len() - before <= room);
        }
        (line.room, line.broken) = (usize::MAX, false);
        port.service(&mut line, |_| true).expect("the line holds");
        let sent = frames(&line.sent);
        let number_of = |frame: &DataFrame| u64::from_le_bytes(frame.data().try_into().expect("eight bytes"));
        prop_assert_eq!(sent.len() as u64 + u64::from(port.dropped()), number);
        prop_assert!(sent.is_sorted_by(|a, b| number_of(a) < number_of(b)));
        let answers = [&b""[..], b"V0101", b"NGYRO", b"F00", b"F02"];
        for text in texts(&line.sent) {
            let known = answers.contains(&text) || slcan::parse::<DataFrame>(text).is_ok();
            prop_assert!(known, "{}", text.escape_ascii());
        }
    }
}
