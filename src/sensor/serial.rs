//! A sensor on a serial port, through the traits of `embedded-io`. Nothing here depends on a particular sensor.
//!
//! No read blocks: a port must say whether bytes wait ([`ReadReady`]). There are no async wrappers: parsers accept
//! bytes, so an async caller awaits its own read.

use super::{ByteSource, Source};
use embedded_io::{Read, ReadReady};

/// Largest number of bytes read by one call of [`Serial::next_sample`].
const MAX_READ: usize = 1024;

/// The error of a serial sensor: of the port or of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SerialError<P, E> {
    /// The port failed, for example by an overrun or a framing error.
    #[error("the serial port failed: {0:?}")]
    Port(P),
    /// The data of the sensor are wrong, or missing.
    #[error(transparent)]
    Part(E),
}

/// A sensor on a serial port, as a [`Source`].
#[derive(Debug)]
pub struct Serial<PORT, PART> {
    port: PORT,
    part: PART,
}

impl<PORT, PART> Serial<PORT, PART> {
    /// Creates a source from a port and the parser of a configured sensor.
    pub const fn new(port: PORT, part: PART) -> Self {
        Self { port, part }
    }

    /// Returns the parser, for its counters.
    pub const fn part(&self) -> &PART {
        &self.part
    }

    /// Releases port and parser.
    pub fn destroy(self) -> (PORT, PART) {
        (self.port, self.part)
    }
}

impl<PORT: Read + ReadReady, PART: ByteSource> Source for Serial<PORT, PART> {
    type Sample = PART::Sample;
    type Error = SerialError<PORT::Error, PART::Error>;

    /// Reads waiting bytes until they complete a sample; at most `MAX_READ` bytes.
    fn next_sample(&mut self) -> Option<Result<PART::Sample, Self::Error>> {
        for _ in 0..MAX_READ {
            if let Some(sample) = self.part.next_sample() {
                return Some(sample.map_err(SerialError::Part));
            }
            match receive(&mut self.port, &mut [0]) {
                Ok(&[byte]) => self.part.receive(byte),
                Ok(_) => return None,
                Err(error) => return Some(Err(SerialError::Port(error))),
            }
        }
        self.part.next_sample().map(|sample| sample.map_err(SerialError::Part))
    }
}

/// Reads the bytes that are waiting at the port, up to the length of `to`.
fn receive<'a, PORT: Read + ReadReady>(port: &mut PORT, to: &'a mut [u8]) -> Result<&'a [u8], PORT::Error> {
    let count = if port.read_ready()? { port.read(to)? } else { 0 };
    Ok(to.get(..count).unwrap_or_default())
}
