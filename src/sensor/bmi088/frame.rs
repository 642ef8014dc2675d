//! The bytes that the BMI088's dies send. There is no checksum: a bit error on the bus gives a wrong reading, unless it is
//! in a header. All numbers are little-endian, but for the temperature.
//!
//! | what | bytes |
//! |---|---|
//! | gyro, a frame of the FIFO | i16 rate x, y, z |
//! | accelerometer, a frame of the FIFO | header 84 to 87, i16 acceleration x, y, z |
//! | accelerometer, other frames | header 40 skipped, 44 time, 48 setting changed, 50 dropped; 80 empty |
//! | accelerometer, registers 18 to 25 | u24 time, 7 others, i11 temperature in a u16, u16 bytes in the FIFO |
//!
//! The other frames are shorter. What was read beyond one is given again, since a frame that is read in part stays.

use crate::sample::ImuSample;
use crate::sensor::spi;
use crate::units::{CentiCelsius, Micros};

pub const FORCE_FRAME: usize = 7;
pub const STATE: usize = 14;
pub const TIME_MASK: u32 = 0xFF_FFFF;

/// Header of an acceleration, and the bits that identify it; the two below are tags.
const FORCE_HEADER: u8 = 0x84;
const CONTENT: u8 = 0xFC;
/// Bits of the FIFO's length; above them is a mark of an empty one.
const LENGTH: u16 = 0x3FFF;
const NO_TEMPERATURE: u8 = 0x80;
/// Counts per deg/s in the range of 250 deg/s, and per g in that of 12 g.
const PER_DPS: f32 = 131.072;
const PER_G: f32 = 32_768.0 / 12.0;

/// Parses an acceleration; `None` for another frame.
pub fn acceleration(&[header, ref axes @ ..]: &[u8; FORCE_FRAME]) -> Option<[i16; 3]> {
    (header & CONTENT == FORCE_HEADER).then(|| spi::vector(axes))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct State {
    /// Time, counts of 39.0625 us modulo 2^24.
    pub time: u32,
    /// Temperature, eighths of a deg C above 23; `None` is a missing one.
    pub temperature: Option<i16>,
    pub bytes: usize,
}

impl State {
    pub fn parse(&[t0, t1, t2, .., high, low, l0, l1]: &[u8; STATE]) -> Self {
        Self {
            time: u32::from_le_bytes([t0, t1, t2, 0]),
            temperature: (high != NO_TEMPERATURE).then(|| i16::from_be_bytes([high, low]) >> 5),
            bytes: usize::from(u16::from_le_bytes([l0, l1]) & LENGTH),
        }
    }
}

/// Converts readings to the pipeline's units; `None` if one does not fit.
pub fn sample(time: Micros, force: [i16; 3], rate: [i16; 3], temperature: Option<i16>) -> Option<ImuSample> {
    let clipped = |count: &i16| *count == i16::MAX || *count <= -i16::MAX;
    let is_clipped = force.iter().chain(&rate).any(clipped);
    // A reading of 11 bits is within -105 and 151 deg C.
    let temperature = temperature.map(|eighths| CentiCelsius((i32::from(eighths) * 25 / 2 + 2_300) as i16));
    let (g, dps) = (force.map(|n| f32::from(n) / PER_G), rate.map(|n| f32::from(n) / PER_DPS));
    spi::sample(time, g, dps, temperature, is_clipped)
}
