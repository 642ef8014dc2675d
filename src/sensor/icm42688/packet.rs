//! A packet is one entry of the ICM-42688-P's FIFO.
//!
//! | offset | packet 3, 16 bytes | packet 4, 20 bytes |
//! |---|---|---|
//! | 0 | header 68 | header 78 |
//! | 1 | i16 acceleration x, y, z | the same, bits 19-4 of 20 |
//! | 7 | i16 rate x, y, z | the same, bits 19-4 of 20 |
//! | 13 | i8 temperature, t / 2.07 + 25 deg C | i16 temperature, t / 132.48 + 25 deg C |
//! | end | u16 time, 32/30 us | u16 time, 32/30 us, then bits 3-0 for x, y, z: acceleration high, rate low nibble |
//!
//! Bit 7 of the header means that the FIFO was empty. The most negative value (-524288 for 20 bits) marks a missing
//! reading. There is no checksum: a bit error on the bus gives a wrong reading, unless it is in the header.

use heapless::Vec;

/// Length of the longer packet, bytes.
pub const MAX_PACKET: usize = 20;
const EMPTY: u8 = 0x80;
const HEADER_16: u8 = 0x68;
const HEADER_20: u8 = 0x78;
/// Header bits that identify the content; the two bits below signal a changed output rate.
const CONTENT: u8 = 0xFC;
const NO_READING_16: i32 = -32_768;
const NO_READING_20: i32 = -524_288;

/// The kind of packet, which determines the resolution of its readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Resolution {
    /// Packet 3: 16 bits per reading, over the configured range.
    Bits16,
    /// Packet 4: 20 bits per reading, always over the largest range.
    #[default]
    Bits20,
}

impl Resolution {
    /// Returns the length of a packet, bytes.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Bits16 => 16,
            Self::Bits20 => 20,
        }
    }
}

/// The reason why bytes are not a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PacketError {
    /// The number of bytes is not the length of a packet.
    #[error("ICM-42688: {got} bytes for a packet of {expected}")]
    Length {
        /// Number of bytes given.
        got: usize,
        /// Length of the packet.
        expected: usize,
    },
    /// The FIFO was empty.
    #[error("ICM-42688: the FIFO was empty")]
    Empty,
    /// The header is not that of the configured packet: reading is out of step, or a setting is lost.
    #[error("ICM-42688: header {got:02x} is not that of the configured packet")]
    Header {
        /// The header.
        got: u8,
    },
}

/// The readings of a packet in raw counts; `None` is a missing reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Kind of packet.
    pub resolution: Resolution,
    /// Acceleration x, y, z, 16 or 20 bits.
    pub acceleration: [Option<i32>; 3],
    /// Rate about x, y, z, 16 or 20 bits.
    pub rate: [Option<i32>; 3],
    /// Temperature, 8 or 16 bits.
    pub temperature: Option<i16>,
    /// Time stamp, counts of 32/30 us modulo 2^16.
    pub time: u16,
}

impl Packet {
    /// Parses a packet.
    pub fn parse(resolution: Resolution, bytes: &[u8]) -> Result<Self, PacketError> {
        let length = PacketError::Length { got: bytes.len(), expected: resolution.bytes() };
        let (&[header, ax1, ax0, ay1, ay0, az1, az0, gx1, gx0, gy1, gy0, gz1, gz0], rest) =
            bytes.split_first_chunk().ok_or(length)?;
        let words = [[ax1, ax0], [ay1, ay0], [az1, az0], [gx1, gx0], [gy1, gy0], [gz1, gz0]];
        let high = words.map(|word| i32::from(i16::from_be_bytes(word)));
        let (code, temperature, time, readings, no_acceleration, no_rate) = match (resolution, rest) {
            (Resolution::Bits16, &[t, u1, u0]) => {
                // A temperature of -128 is the upper byte of -32768.
                let temperature = i8::from_be_bytes([t]);
                let temperature = (temperature != i8::MIN).then_some(i16::from(temperature));
                (HEADER_16, temperature, [u1, u0], high, NO_READING_16, NO_READING_16)
            }
            (Resolution::Bits20, &[t1, t0, u1, u0, x, y, z]) => {
                let temperature = i16::from_be_bytes([t1, t0]);
                let temperature = (temperature != i16::MIN).then_some(temperature);
                let low = [x >> 4, y >> 4, z >> 4, x & 15, y & 15, z & 15].map(i32::from);
                let full = core::array::from_fn(|n| high[n] << 4 | low[n]);
                (HEADER_20, temperature, [u1, u0], full, NO_READING_20, NO_READING_20)
            }
            _ => return Err(length),
        };
        if header & EMPTY != 0 {
            return Err(PacketError::Empty);
        }
        if header & CONTENT != code {
            return Err(PacketError::Header { got: header });
        }
        let reading = |n: usize, none: i32| Some(readings[n]).filter(|value| *value != none);
        Ok(Self {
            resolution,
            acceleration: core::array::from_fn(|axis| reading(axis, no_acceleration)),
            rate: core::array::from_fn(|axis| reading(3 + axis, no_rate)),
            temperature,
            time: u16::from_be_bytes(time),
        })
    }

    /// Encodes the packet; each reading is truncated to the bits of its field.
    pub fn emit(&self) -> Vec<u8, MAX_PACKET> {
        let mut bytes = Vec::new();
        // MAX_PACKET bytes hold either packet.
        let mut put = |part: &[u8]| drop(bytes.extend_from_slice(part));
        let wide = self.resolution == Resolution::Bits20;
        let (header, none) = if wide { (HEADER_20, NO_READING_20) } else { (HEADER_16, NO_READING_16) };
        put(&[header]);
        let acceleration = self.acceleration.map(|reading| reading.unwrap_or(none));
        let rate = self.rate.map(|reading| reading.unwrap_or(none));
        for reading in acceleration.iter().chain(&rate) {
            let high = if wide { reading >> 4 } else { *reading };
            put(&(high as i16).to_be_bytes());
        }
        if wide {
            put(&self.temperature.unwrap_or(i16::MIN).to_be_bytes());
        } else {
            put(&(self.temperature.map_or(i8::MIN, |t| t as i8)).to_be_bytes());
        }
        put(&self.time.to_be_bytes());
        if wide {
            for (a, w) in acceleration.iter().zip(&rate) {
                put(&[((a & 15) << 4 | w & 15) as u8]);
            }
        }
        bytes
    }
}
