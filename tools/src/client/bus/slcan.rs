//! An SLCAN line carries frames as text over any byte stream.

use super::{Bus, WAIT, computer_time};
use crate::client::connection::{self, ConnectError, Connection, is_silence};
use gyronet::can::{DataFrame, slcan};
use std::io::{ErrorKind, Read, Result, Write};
use std::time::Duration;

/// The answer to a refused command; no line end follows.
const BELL: u8 = 7;
/// Characters of a line that are kept; no valid line is as long.
const LONGEST: usize = 64;

/// A byte stream whose reads return after a short time with the bytes that have arrived.
pub trait Line: Read + Write {
    /// Returns the time since an arbitrary but fixed moment.
    fn now(&mut self) -> Duration {
        computer_time()
    }
}

impl Line for Connection {}

pub struct SlcanBus<L> {
    line: L,
    text: Vec<u8>,
    /// True once a CR was sent, which ends a line that an earlier program may have left in the other end's buffer.
    is_clean: bool,
}

impl SlcanBus<Connection> {
    pub fn open(name: &str, baud: u32) -> std::result::Result<Self, ConnectError> {
        Ok(Self::new(connection::open(name, baud, WAIT)?))
    }
}

impl<L: Line> SlcanBus<L> {
    pub fn new(line: L) -> Self {
        Self { line, text: Vec::new(), is_clean: false }
    }
}

impl<L: Line> Bus for SlcanBus<L> {
    fn send(&mut self, frame: &DataFrame) -> Result<()> {
        let text = slcan::emit(frame).ok_or(ErrorKind::InvalidInput)?;
        if !std::mem::replace(&mut self.is_clean, true) {
            self.line.write_all(b"\r")?;
        }
        self.line.write_all(&text)?;
        self.line.flush()
    }

    fn receive(&mut self) -> Result<Vec<DataFrame>> {
        let mut bytes = [0; 512];
        let len = match self.line.read(&mut bytes) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(len) => len,
            Err(error) if is_silence(&error) => 0,
            Err(error) => return Err(error),
        };
        let mut frames = Vec::new();
        for byte in bytes.into_iter().take(len) {
            match byte {
                // A line that is not a frame is an answer to a command.
                b'\r' => frames.extend(slcan::parse::<DataFrame>(&std::mem::take(&mut self.text))),
                BELL => self.text.clear(),
                _ if self.text.len() < LONGEST => self.text.push(byte),
                _ => {}
            }
        }
        Ok(frames)
    }

    fn now(&mut self) -> Duration {
        self.line.now()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_can::Frame;
    use std::collections::VecDeque;

    /// A line that yields these bytes, then times out, and records the written bytes.
    struct Script(VecDeque<u8>, Vec<u8>);

    impl Read for Script {
        fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
            if self.0.is_empty() { Err(ErrorKind::TimedOut.into()) } else { self.0.read(bytes) }
        }
    }

    impl Write for Script {
        fn write(&mut self, bytes: &[u8]) -> Result<usize> {
            self.1.write(bytes)
        }

        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }

    impl Line for Script {}

    #[test]
    fn frames_are_read_between_answers() {
        let text = b"\r\x07t7E8210FF\rV0101\rt7E83\rT18DAF1101AA\r t1";
        let mut bus = SlcanBus::new(Script(text.iter().copied().collect(), Vec::new()));
        let frames = bus.receive().expect("it is open");
        let data: Vec<&[u8]> = frames.iter().map(Frame::data).collect();
        assert_eq!(data, [&[0x10, 0xFF][..], &[0xAA]]);
        assert_eq!(bus.receive().expect("silence is no error"), []);
        bus.send(&frames[0]).expect("it is written");
        assert_eq!(bus.line.1, b"\rt7E8210FF\r");
    }
}
