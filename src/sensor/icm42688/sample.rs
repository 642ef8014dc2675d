//! Converts a packet's counts to the pipeline's units.

use super::packet::Packet;
use crate::sample::{ImuSample, Validity};
use crate::units::{AngularRate, CentiCelsius, Micros, STANDARD_GRAVITY, SpecificForce};

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
        let rate = |reading: Option<i32>| {
            AngularRate::from_rad_per_sec((reading? as f32 / PER_DPS).to_radians()).ok()
        };
        let force = |reading: Option<i32>| {
            SpecificForce::from_metre_per_sec2(reading? as f32 / PER_G * STANDARD_GRAVITY).ok()
        };
        let ([ax, ay, az], [gx, gy, gz]) = (self.acceleration, self.rate);
        let mut readings = self.acceleration.iter().chain(&self.rate).flatten();
        Some(ImuSample {
            time,
            specific_force: [force(ax)?, force(ay)?, force(az)?],
            angular_rate: [rate(gx)?, rate(gy)?, rate(gz)?],
            temperature: self.temperature.map(|code| {
                // The value is at most 27,000.
                CentiCelsius(libm::roundf(f32::from(code) * (100.0 / PER_DEGREE) + 2500.0) as i16)
            }),
            validity: Validity::reported(readings.any(|reading| *reading <= ENDS[0] || *reading >= ENDS[1])),
        })
    }
}
