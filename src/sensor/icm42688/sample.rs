//! Converts a packet's counts to the pipeline's units.

use super::packet::{Packet, Resolution};
use crate::sample::{ImuSample, Validity};
use crate::units::{AngularRate, CentiCelsius, Micros, STANDARD_GRAVITY, SpecificForce};

impl Resolution {
    /// Returns the counts per deg/s in the range that the driver sets.
    #[must_use]
    pub const fn counts_per_dps(self) -> f32 {
        match self {
            // The range is 250 deg/s: eight times the 16.4 counts per deg/s of the range of 2000 deg/s.
            Self::Bits16 => 131.0,
            // Twice 131, because the lowest bit is always 0.
            Self::Bits20 => 262.0,
        }
    }

    /// Returns the counts per g in the range that the driver sets.
    #[must_use]
    pub const fn counts_per_g(self) -> f32 {
        match self {
            // The range is 16 g.
            Self::Bits16 => 2048.0,
            // Four times 8192, because the lowest two bits are always 0.
            Self::Bits20 => 32_768.0,
        }
    }

    /// Returns the counts per deg C above 25.
    const fn counts_per_degree(self) -> f32 {
        match self {
            Self::Bits16 => 2.07,
            Self::Bits20 => 132.48,
        }
    }
}

impl Packet {
    /// Converts the readings, taken at `time`, to the pipeline's units; `None` where an axis has no reading.
    pub fn sample(&self, time: Micros) -> Option<ImuSample> {
        let (per_dps, per_g) = (self.resolution.counts_per_dps(), self.resolution.counts_per_g());
        let rate = |reading: Option<i32>| {
            AngularRate::from_rad_per_sec((reading? as f32 / per_dps).to_radians()).ok()
        };
        let force = |reading: Option<i32>| {
            SpecificForce::from_metre_per_sec2(reading? as f32 / per_g * STANDARD_GRAVITY).ok()
        };
        let ([ax, ay, az], [gx, gy, gz]) = (self.acceleration, self.rate);
        let per_degree = self.resolution.counts_per_degree();
        let readings = || self.acceleration.iter().chain(&self.rate).flatten();
        Some(ImuSample {
            time,
            specific_force: [force(ax)?, force(ay)?, force(az)?],
            angular_rate: [rate(gx)?, rate(gy)?, rate(gz)?],
            temperature: self.temperature.map(|code| {
                // The value is at most 27,000.
                CentiCelsius(libm::roundf(f32::from(code) * (100.0 / per_degree) + 2500.0) as i16)
            }),
            validity: Validity::reported(readings().any(|reading| clipped(self.resolution, *reading))),
        })
    }
}

/// Returns whether a reading is at an end of the range. With FIFO_HOLD_LAST_DATA_EN = 0, as after a reset, the lowest
/// reading is -32,766 for 16 bits and -524,256 for 20, because lower codes mark a missing reading (DS-000347, 12.8).
const fn clipped(resolution: Resolution, reading: i32) -> bool {
    match resolution {
        Resolution::Bits16 => reading <= -32_766 || reading >= 32_767,
        // Of 20 bits, the lowest is always 0 in a rate, and the lowest two in an acceleration.
        Resolution::Bits20 => reading <= -524_256 || reading >= 524_284,
    }
}
