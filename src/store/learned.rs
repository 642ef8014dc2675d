//! This record holds what the board has learnt about its sensor: the bias over temperature, the up and forward
//! directions, and the gain.

use super::error::{Field, FieldError};
use super::record::Record;
use crate::bias::ThermalBias;
use crate::heading::Gain;
use crate::health::slow::Knowledge;
use crate::mounting::{Forward, Rotation, Vertical, is_moved};
use crate::units::SpecificForce;
use serde::{Deserialize, Serialize};

/// Weight of a new standstill in the mean specific force: 1 / `MEMORY`.
const MEMORY: i64 = 8;
/// Largest sigma of a forward direction that is known well, deg.
const FINE_DEG: f32 = 3.0;

/// The sensor data that the board learns at standstills and while driving, in sensor axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Learned {
    /// Bias of the gyro by temperature.
    pub thermal_bias: ThermalBias,
    /// Mean specific force at standstill; `None` before the first standstill.
    pub specific_force: Option<[SpecificForce; 3]>,
    /// What standstills and turns have shown of the vertical.
    pub vertical: Vertical,
    /// Forward direction of the vehicle; `None` until it is known within 10 degrees.
    pub forward: Option<Forward>,
    /// Gain of the yaw gyro, by courses; `None` until they have shown it.
    pub gain: Option<Gain>,
}

impl Learned {
    /// Record before anything was learnt.
    pub const NOTHING: Self = Self {
        thermal_bias: ThermalBias::UNKNOWN,
        specific_force: None,
        vertical: Vertical::UNKNOWN,
        forward: None,
        gain: None,
    };

    /// Returns whether a specific force at rest shows that the sensor has moved.
    pub fn is_moved(&self, specific_force: &[SpecificForce; 3]) -> bool {
        self.specific_force.is_some_and(|known| is_moved(&known, specific_force))
    }

    /// Adds the mean specific force of a standstill. Call it once per standstill.
    pub fn add_standstill(&mut self, specific_force: [SpecificForce; 3]) {
        let known = self.specific_force.get_or_insert(specific_force);
        for (mean, force) in known.iter_mut().zip(specific_force) {
            mean.0 += ((i64::from(force.0) - i64::from(mean.0)) / MEMORY) as i32;
        }
    }
}

impl Learned {
    /// Returns the angle from a mounting's x axis to forward, left positive (0 if correct), and its sigma, deg.
    pub fn yaw_deg(&self, mounting: &Rotation) -> Option<[f32; 2]> {
        let (forward, rest) = self.forward.zip(self.specific_force)?;
        Some([forward.yaw(mounting, rest), forward.sigma].map(f32::to_degrees))
    }

    /// How well drives have shown the forward direction.
    pub fn forward_knowledge(&self, mounting: &Rotation) -> Knowledge {
        match self.yaw_deg(mounting) {
            None => Knowledge::Unknown,
            Some([_, sigma]) if sigma <= FINE_DEG => Knowledge::Fine,
            Some(_) => Knowledge::Coarse,
        }
    }
}

impl Record for Learned {
    const KEY: u8 = 7;
    const VERSION: u8 = 4;

    fn check(&self) -> Result<(), FieldError> {
        if !self.thermal_bias.is_plausible() {
            return Err(FieldError::Implausible(Field::ThermalBias));
        }
        if !self.vertical.is_plausible() {
            return Err(FieldError::Implausible(Field::Vertical));
        }
        if !self.forward.is_none_or(|forward| forward.is_plausible()) {
            return Err(FieldError::Implausible(Field::Forward));
        }
        if !self.gain.is_none_or(|gain| gain.is_plausible()) {
            return Err(FieldError::Implausible(Field::Gain));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(x: f32, z: f32) -> [SpecificForce; 3] {
        [x, 0.0, z].map(|axis| SpecificForce::from_metre_per_sec2(axis).unwrap())
    }

    #[test]
    fn a_sensor_that_was_moved_is_told_from_a_steep_street() {
        let mut learned = Learned::NOTHING;
        assert!(!learned.is_moved(&force(6.0, 7.7)), "nothing is known");
        learned.add_standstill(force(0.0, 9.8));
        // A road with a slope of 15 degrees.
        assert!(!learned.is_moved(&force(2.54, 9.47)));
        learned.add_standstill(force(2.54, 9.47));
        assert!(learned.is_moved(&force(6.0, 7.7)));
    }
}
