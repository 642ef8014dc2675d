//! Parses and encodes the data messages of the DSP-1760, field by field.
//!
//! | offset | format A, 36 bytes | format B, 40 bytes |
//! |---|---|---|
//! | 0 | FE 81 FF 55 | FE 81 FF 56 |
//! | 4 | f32 rotation x, y, z | same |
//! | 16 | f32 acceleration x, y, z | same |
//! | 28 | status, sequence | u32 time, microseconds |
//! | 30 | i16 temperature | (time) |
//! | 32 | CRC | status, sequence, i16 temperature |
//! | 36 | | CRC |
//!
//! All values are big-endian.

pub use super::format::{Extra, Format, Validity};

use super::format::PREFIX;
use crate::sensor::crc::CRC_32_MPEG_2;
use heapless::Vec;

/// Length of the longest message, bytes.
pub const MAX_MESSAGE: usize = 40;
/// The largest sequence number; 0 follows it.
pub const MAX_SEQUENCE: u8 = 127;

/// The reason why bytes are not a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "its messages say it")]
pub enum MessageError {
    #[error("DSP-1760: not the header of a data message")]
    Header,
    #[error("DSP-1760: {got} bytes where the header announces {expected}")]
    Length { got: usize, expected: usize },
    #[error("DSP-1760: CRC {computed:08x}, but the message carries {stored:08x}")]
    Crc { computed: u32, stored: u32 },
    #[error("DSP-1760: sequence number {got}, above {MAX_SEQUENCE}")]
    Sequence { got: u8 },
}

/// A data message, in the units of the wire format.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Message {
    /// Increment about x, y, z, rad.
    pub rotation: [f32; 3],
    /// Specific force x, y, z in g; only the 17xx units measure it, not the DSP-1760.
    pub acceleration: [f32; 3],
    /// Fields that only this format has.
    pub extra: Extra,
    /// Status bits of the readings.
    pub validity: Validity,
    /// Sequence number, 0 to [`MAX_SEQUENCE`].
    pub sequence: u8,
}

impl Message {
    /// Returns the format of the message.
    pub const fn format(&self) -> Format {
        match self.extra {
            Extra::Temperature(_) => Format::A,
            Extra::Timed { .. } => Format::B,
        }
    }

    /// Parses a whole message. The valid bit of a reading that is not finite is cleared.
    pub fn parse(frame: &[u8]) -> Result<Self, MessageError> {
        let format = frame.first_chunk().copied().and_then(Format::of).ok_or(MessageError::Header)?;
        let length = MessageError::Length { got: frame.len(), expected: format.length() };
        if frame.len() != format.length() {
            return Err(length);
        }
        let (content, stored) = frame.split_last_chunk::<4>().ok_or(length)?;
        let (computed, stored) = (CRC_32_MPEG_2.checksum(content), u32::from_be_bytes(*stored));
        if computed != stored {
            return Err(MessageError::Crc { computed, stored });
        }
        Self::parse_checked(frame)
    }

    /// Parses a frame whose CRC has already been checked.
    pub(super) fn parse_checked(frame: &[u8]) -> Result<Self, MessageError> {
        let format = frame.first_chunk().copied().and_then(Format::of).ok_or(MessageError::Header)?;
        let length = MessageError::Length { got: frame.len(), expected: format.length() };
        let (content, _) = frame.split_last_chunk::<4>().ok_or(length)?;
        let (readings, tail) = content.get(4..).and_then(|rest| rest.split_at_checked(24)).ok_or(length)?;
        let (words, _) = readings.as_chunks::<4>();
        let reading = |n: usize| words.get(n).map_or(f32::NAN, |word| f32::from_be_bytes(*word));
        let rotation = core::array::from_fn(reading);
        let acceleration = core::array::from_fn(|axis| reading(3 + axis));
        let (extra, status, sequence) = match *tail {
            [status, sequence, t1, t0] => {
                (Extra::Temperature(i16::from_be_bytes([t1, t0])), status, sequence)
            }
            [u3, u2, u1, u0, status, sequence, t1, t0] => {
                let time = u32::from_be_bytes([u3, u2, u1, u0]);
                (Extra::Timed { time, temperature: i16::from_be_bytes([t1, t0]) }, status, sequence)
            }
            _ => return Err(length),
        };
        if sequence > MAX_SEQUENCE {
            return Err(MessageError::Sequence { got: sequence });
        }
        let validity = Validity(status & numbers(&rotation, &acceleration));
        Ok(Self { rotation, acceleration, extra, validity, sequence })
    }

    /// Encodes the message, CRC included.
    pub fn emit(&self) -> Vec<u8, MAX_MESSAGE> {
        let mut frame = Vec::new();
        // MAX_MESSAGE bytes hold every format.
        let mut put = |bytes: &[u8]| drop(frame.extend_from_slice(bytes));
        put(&PREFIX);
        put(&[self.format().header_byte()]);
        self.rotation.iter().chain(&self.acceleration).for_each(|reading| put(&reading.to_be_bytes()));
        let counted = [self.validity.0, self.sequence & MAX_SEQUENCE];
        match self.extra {
            Extra::Temperature(temperature) => {
                put(&counted);
                put(&temperature.to_be_bytes());
            }
            Extra::Timed { time, temperature } => {
                put(&time.to_be_bytes());
                put(&counted);
                put(&temperature.to_be_bytes());
            }
        }
        let crc = CRC_32_MPEG_2.checksum(&frame);
        let _ = frame.extend_from_slice(&crc.to_be_bytes());
        frame
    }
}

/// Returns the status bits that may stay set: those of finite readings, and the two unused ones.
fn numbers(rotation: &[f32; 3], acceleration: &[f32; 3]) -> u8 {
    let bits = |readings: &[f32; 3]| {
        (0u8..).zip(readings).fold(0, |bits, (axis, reading)| bits | u8::from(reading.is_finite()) << axis)
    };
    bits(rotation) | bits(acceleration) << 4 | 0x88
}
