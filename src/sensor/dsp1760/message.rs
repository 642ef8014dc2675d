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

use heapless::Vec;

/// CRC-32/MPEG-2 of the KVH gyros: 04C11DB7, start FFFFFFFF, not reflected, no final inversion; 0 over a whole frame.
/// A `static`, so that an image has its table (1 KB) once.
pub static CRC_32_MPEG_2: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_MPEG_2);
pub const MAX_MESSAGE: usize = 40;
/// The largest sequence number; 0 follows it.
pub const MAX_SEQUENCE: u8 = 127;

/// The format of a message, selected by its fourth byte. The gyro's third one (57, with slow readings) is not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Format {
    A = 0x55,
    B = 0x56,
}

impl Format {
    pub const fn of(header: [u8; 4]) -> Option<Self> {
        match header {
            [0xFE, 0x81, 0xFF, code] if code == Self::A as u8 => Some(Self::A),
            [0xFE, 0x81, 0xFF, code] if code == Self::B as u8 => Some(Self::B),
            _ => None,
        }
    }

    pub const fn length(self) -> usize {
        match self {
            Self::A => 36,
            Self::B => 40,
        }
    }
}

/// The status bits of the readings, 1 for good; bits 3 and 7 are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity(pub u8);

impl Validity {
    pub const GYRO: Self = Self(0x07);
    pub const ALL: Self = Self(0x77);

    /// Returns whether the gyro about `axis` (0 to 2) is good; the bit is 0 when the gyro is saturated.
    pub const fn gyro(self, axis: usize) -> bool {
        axis < 3 && self.0 & 1 << axis != 0
    }

    pub const fn accelerometer(self, axis: usize) -> bool {
        axis < 3 && self.0 & 0x10 << axis != 0
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extra {
    Temperature(i16),
    Timed {
        /// Time, microseconds; it wraps.
        time: u32,
        temperature: i16,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum MessageError {
    #[error("DSP-1760: not the header of a data message")]
    Header,
    #[error("DSP-1760: {got} bytes where the header announces {expected}")]
    Length { got: usize, expected: usize },
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
    pub extra: Extra,
    pub validity: Validity,
    pub sequence: u8,
}

impl Message {
    pub const fn format(&self) -> Format {
        match self.extra {
            Extra::Temperature(_) => Format::A,
            Extra::Timed { .. } => Format::B,
        }
    }

    /// Parses a whole message, whose CRC the framer has checked. The valid bit of a reading that is not finite is cleared.
    pub fn parse(frame: &[u8]) -> Result<Self, MessageError> {
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

    pub fn emit(&self) -> Vec<u8, MAX_MESSAGE> {
        let mut frame = Vec::new();
        // MAX_MESSAGE bytes hold every format.
        let mut put = |bytes: &[u8]| drop(frame.extend_from_slice(bytes));
        put(&[0xFE, 0x81, 0xFF, self.format() as u8]);
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
