//! Converts a packet's counts to the pipeline's units.

use super::packet::Packet;
use crate::sample::ImuSample;
use crate::sensor::spi;
use crate::units::{CentiCelsius, Micros};

/// Counts per deg/s: 131 in the range of 250 deg/s that 16 bits have, twice that because the lowest bit is always 0.
const PER_DPS: f32 = 262.0;
/// Counts per g: four times 8192, because the lowest two bits are always 0.
const PER_G: f32 = 32_768.0;
/// Counts per deg C above 25.
const PER_DEGREE: f32 = 132.48;
/// Readings at an end of the range. Of the 20 bits, the lowest is always 0 in a rate, and the lowest two in an
/// acceleration. With FIFO_HOLD_LAST_DATA_EN = 0, as after a reset, lower codes mark a missing reading (DS-000347, 12.8).
const ENDS: [i32; 2] = [-524_256, 524_284];

impl Packet {
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
