//! The flash may be written only at standstill, because an erase stalls the processor for up to 2 s.
//!
//! Wheels prove standstill or motion. Without wheels, the inertial sensor must have been as quiet as at static
//! initialisation for three seconds. While the sensor is silent, no rate is sent that a receiver could miss, so
//! writing is allowed: a bench without a sensor works.

use crate::bias::{QuietConfig, QuietDetector, Rest, StaticConfig};
use crate::sample::{ImuSample, Standstill};

/// The gate that permits writing the flash; it observes the sensor and the wheels.
#[derive(Debug)]
pub struct StandstillGate {
    quiet: Option<QuietDetector>,
    open: bool,
}

impl StandstillGate {
    /// Creates an open gate, because no rate is valid at the start.
    #[must_use]
    pub const fn new() -> Self {
        Self { quiet: None, open: true }
    }

    /// Returns whether the flash may be written now.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    /// Processes a sample of the sensor (`None` while it is silent) and the standstill state of the wheels.
    pub fn observe(&mut self, sample: Option<&ImuSample>, wheels: Standstill, limits: &StaticConfig) {
        let quiet =
            self.quiet.get_or_insert_with(|| QuietDetector::new(QuietConfig::DEFAULT, limits, &ANY_REST));
        let still = sample.is_none_or(|sample| quiet.observe(sample));
        self.open = match wheels {
            Standstill::Still => true,
            Standstill::Moving => false,
            Standstill::Unknown => still,
        };
    }
}

impl Default for StandstillGate {
    fn default() -> Self {
        Self::new()
    }
}

/// Readings at rest that do not change the limits of static initialisation.
const ANY_REST: Rest = Rest {
    angular_rate: [crate::units::AngularRate(0); 3],
    specific_force: [crate::units::SpecificForce(0); 3],
    gyro_std: [f32::INFINITY; 3],
    accel_std: [f32::INFINITY; 3],
};
