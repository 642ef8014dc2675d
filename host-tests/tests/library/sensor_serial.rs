//! Samples from a part behind a serial port, and a port that fails.

use embedded_io::{ErrorKind, ErrorType, Read, ReadReady};
use gyronet::sensor::Source;
use gyronet::sensor::serial::{Serial, SerialError};
use gyronet::sensor::xsens::{MtData2, Mti, XsensError};
use gyronet_host_tests::wire::{feed_new, message, real_frame};
use std::collections::VecDeque;

/// The board's port. A byte `None` is one that the port has lost.
#[derive(Default)]
struct Port {
    waiting: VecDeque<Option<u8>>,
}

impl ErrorType for Port {
    type Error = ErrorKind;
}

impl ReadReady for Port {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.waiting.is_empty())
    }
}

impl Read for Port {
    fn read(&mut self, to: &mut [u8]) -> Result<usize, ErrorKind> {
        let mut count = 0;
        for slot in to {
            match self.waiting.pop_front() {
                Some(Some(byte)) => *slot = byte,
                Some(None) if count == 0 => return Err(ErrorKind::Other),
                Some(None) => {
                    self.waiting.push_front(None);
                    break;
                }
                None => break,
            }
            count += 1;
        }
        assert!(count > 0, "a read that would wait for ever");
        Ok(count)
    }
}

#[test]
fn an_mti_measures_over_a_port_that_loses_a_byte() {
    // Two frames, a lost byte, a damaged frame, a frame.
    let mut port = Port::default();
    let bytes = [&real_frame()[..], &message(200).emit()].concat();
    port.waiting.extend(bytes.iter().map(|byte| Some(*byte)));
    port.waiting.push_back(None);
    port.waiting.extend(message(300).emit()[5..].iter().map(|byte| Some(*byte)));
    port.waiting.extend(message(400).emit().iter().map(|byte| Some(*byte)));
    let mut line = Serial::new(port, Mti::new());
    let expected: Vec<_> =
        feed_new(bytes).into_iter().map(|sample| Some(Ok(sample.expect("intact")))).collect();
    assert_eq!([line.next_sample(), line.next_sample()], expected[..]);
    assert_eq!(line.next_sample(), Some(Err(SerialError::Port(ErrorKind::Other))));
    assert_eq!(line.next_sample().map(|sample| sample.expect("intact").time.0), Some(40_000));
    assert_eq!(line.next_sample(), None);
    assert_eq!(line.part().bad_checksums(), 0);
    let (port, _) = line.destroy();
    assert!(port.waiting.is_empty());
}

#[test]
fn a_bad_message_is_not_a_bad_port() {
    let mut port = Port::default();
    let bad = MtData2 { acceleration: None, ..message(1) };
    port.waiting.extend(bad.emit().iter().map(|byte| Some(*byte)));
    let missing = XsensError::Missing { id: 0x4020 };
    assert_eq!(Serial::new(port, Mti::new()).next_sample(), Some(Err(SerialError::Part(missing))));
}
