//! A packet is one entry of the ICM-42688-P's FIFO: packet 4 of the data sheet, with readings of 20 bits, which always
//! cover the largest range.
//!
//! | offset | content |
//! |---|---|
//! | 0 | header 78 |
//! | 1 | bits 19-4 of acceleration x, y, z |
//! | 7 | bits 19-4 of rate x, y, z |
//! | 13 | i16 temperature, t / 132.48 + 25 deg C |
//! | 15 | u16 time, 32/30 us |
//! | 17 | bits 3-0 for x, y, z: acceleration high, rate low nibble |
//!
//! Bit 7 of the header means that the FIFO was empty. The most negative value (-524288) marks a missing reading. There
//! is no checksum: a bit error on the bus gives a wrong reading, unless it is in the header.

use crate::sample::ImuSample;
use crate::sensor::spi;
use crate::units::{CentiCelsius, Micros};

pub const PACKET: usize = 20;
const EMPTY: u8 = 0x80;
const HEADER: u8 = 0x78;
/// Header bits that identify the content; the two bits below signal a changed output rate.
const CONTENT: u8 = 0xFC;
const NO_READING: i32 = -524_288;
/// Counts per deg/s: 131 in the range of 250 deg/s that 16 bits have, twice that because the lowest bit is always 0.
const PER_DPS: f32 = 262.0;
/// Counts per g: four times 8192, because the lowest two bits are always 0.
const PER_G: f32 = 32_768.0;
/// Counts per deg C above 25.
const PER_DEGREE: f32 = 132.48;
/// Readings at an end of the range. Of the 20 bits, the lowest is always 0 in a rate, and the lowest two in an
/// acceleration. With FIFO_HOLD_LAST_DATA_EN = 0, as after a reset, lower codes mark a missing reading (DS-000347, 12.8).
const ENDS: [i32; 2] = [-524_256, 524_284];

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    #[error("ICM-42688: the FIFO was empty")]
    Empty,
    /// The header is not that of the configured packet: reading is out of step, or a setting is lost.
    #[error("ICM-42688: header {got:02x} is not that of the configured packet")]
    Header { got: u8 },
}

/// The readings of a packet in raw counts; `None` is a missing reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet {
    pub acceleration: [Option<i32>; 3],
    pub rate: [Option<i32>; 3],
    pub temperature: Option<i16>,
    /// Time stamp, counts of 32/30 us modulo 2^16.
    pub time: u16,
}

impl Packet {
    pub fn parse(bytes: &[u8; PACKET]) -> Result<Self, PacketError> {
        let &[header, ax1, ax0, ay1, ay0, az1, az0, gx1, gx0, gy1, gy0, gz1, gz0, t1, t0, u1, u0, x, y, z] =
            bytes;
        if header & EMPTY != 0 {
            return Err(PacketError::Empty);
        }
        if header & CONTENT != HEADER {
            return Err(PacketError::Header { got: header });
        }
        let reading = |high: [u8; 2], low: u8| {
            let reading = i32::from(i16::from_be_bytes(high)) << 4 | i32::from(low);
            (reading != NO_READING).then_some(reading)
        };
        let temperature = i16::from_be_bytes([t1, t0]);
        Ok(Self {
            acceleration: [
                reading([ax1, ax0], x >> 4),
                reading([ay1, ay0], y >> 4),
                reading([az1, az0], z >> 4),
            ],
            rate: [reading([gx1, gx0], x & 15), reading([gy1, gy0], y & 15), reading([gz1, gz0], z & 15)],
            temperature: (temperature != i16::MIN).then_some(temperature),
            time: u16::from_be_bytes([u1, u0]),
        })
    }

    /// Encodes the packet; each reading is truncated to the bits of its field.
    pub fn emit(&self) -> [u8; PACKET] {
        let code = |reading: Option<i32>| reading.unwrap_or(NO_READING);
        let (acceleration, rate) = (self.acceleration.map(code), self.rate.map(code));
        let high = |reading: i32| ((reading >> 4) as i16).to_be_bytes();
        let [[ax1, ax0], [ay1, ay0], [az1, az0]] = acceleration.map(high);
        let [[gx1, gx0], [gy1, gy0], [gz1, gz0]] = rate.map(high);
        let [t1, t0] = self.temperature.unwrap_or(i16::MIN).to_be_bytes();
        let [u1, u0] = self.time.to_be_bytes();
        let [x, y, z]: [u8; 3] =
            core::array::from_fn(|axis| ((acceleration[axis] & 15) << 4 | rate[axis] & 15) as u8);
        [HEADER, ax1, ax0, ay1, ay0, az1, az0, gx1, gx0, gy1, gy0, gz1, gz0, t1, t0, u1, u0, x, y, z]
    }

    /// Converts the readings, taken at `time`, to the pipeline's units; `None` where an axis has no reading.
    pub fn sample(&self, time: Micros) -> Option<ImuSample> {
        let ([Some(ax), Some(ay), Some(az)], [Some(gx), Some(gy), Some(gz)]) = (self.acceleration, self.rate)
        else {
            return None;
        };
        let (force, rate) = ([ax, ay, az], [gx, gy, gz]);
        let is_clipped = force.iter().chain(&rate).any(|n| *n <= ENDS[0] || *n >= ENDS[1]);
        // The temperature is at most 27,000.
        let temperature = self
            .temperature
            .map(|code| CentiCelsius(libm::roundf(f32::from(code) * (100.0 / PER_DEGREE) + 2500.0) as i16));
        spi::sample(
            time,
            force.map(|n| n as f32 / PER_G),
            rate.map(|n| n as f32 / PER_DPS),
            temperature,
            is_clipped,
        )
    }
}
