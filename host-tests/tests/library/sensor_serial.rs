//! Samples from a part behind a serial port, and a port that fails.

use super::line::Line;
use embedded_io::ErrorKind;
use gyronet::sensor::Source;
use gyronet::sensor::serial::{Serial, SerialError};
use gyronet::sensor::xsens::{MtData2, Mti, XsensError};
use gyronet_host_tests::wire::{feed_new, message, real_frame};

#[test]
fn an_mti_measures_over_a_port_that_loses_a_byte() {
    // Two frames, a lost byte, a damaged frame, a frame.
    let mut port = Line::default();
    let bytes = [&real_frame()[..], &message(200).emit()].concat();
    port.receive(&bytes);
    port.lose();
    port.receive(&[&message(300).emit()[5..], &message(400).emit()].concat());
    let mut line = Serial::new(port, Mti::new());
    let expected: Vec<_> =
        feed_new(bytes).into_iter().map(|sample| Some(Ok(sample.expect("intact")))).collect();
    assert_eq!([line.next_sample(), line.next_sample()], expected[..]);
    assert_eq!(line.next_sample(), Some(Err(SerialError::Port(ErrorKind::Other))));
    assert_eq!(line.next_sample().map(|sample| sample.expect("intact").time.0), Some(40_000));
    assert_eq!(line.next_sample(), None);
    assert_eq!(line.part().bad_checksums(), 0);
    let (port, _) = line.destroy();
    assert!(port.is_read());
}

#[test]
fn a_bad_message_is_not_a_bad_port() {
    let mut port = Line::default();
    port.receive(&MtData2 { acceleration: None, ..message(1) }.emit());
    let missing = XsensError::Missing { id: 0x4020 };
    assert_eq!(Serial::new(port, Mti::new()).next_sample(), Some(Err(SerialError::Part(missing))));
}
