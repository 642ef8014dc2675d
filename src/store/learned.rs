//! The record of what the board has learnt about its sensor at standstill: the bias by temperature, and where up is.

use super::error::{Field, FieldError};
use super::record::Record;
use crate::bias::BiasCurve;
use crate::mounting::is_moved;
use crate::units::SpecificForce;
use serde::{Deserialize, Serialize};

/// A standstill changes the mean specific force by one part in so many.
const MEMORY: i64 = 8;

/// Holds what standstills have shown about the sensor, in its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Learned {
    /// The gyro's bias by temperature.
    pub bias_curve: BiasCurve,
    /// Mean specific force; `None` before the first standstill.
    pub specific_force: Option<[SpecificForce; 3]>,
}

impl Learned {
    /// Nothing is known.
    pub const NOTHING: Self = Self { bias_curve: BiasCurve::UNKNOWN, specific_force: None };

    /// Takes the mean specific force of a standstill. Returns whether it is that of a sensor that was not moved.
    pub fn accept(&mut self, specific_force: [SpecificForce; 3]) -> bool {
        let known = self.specific_force.get_or_insert(specific_force);
        if is_moved(known, &specific_force) {
            return false;
        }
        for (mean, force) in known.iter_mut().zip(specific_force) {
            mean.0 += ((i64::from(force.0) - i64::from(mean.0)) / MEMORY) as i32;
        }
        true
    }
}

impl Record for Learned {
    const KEY: u8 = 7;
    const VERSION: u8 = 1;

    fn check(&self) -> Result<(), FieldError> {
        if self.bias_curve.is_plausible() { Ok(()) } else { Err(FieldError::Implausible(Field::BiasCurve)) }
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
        assert!(learned.accept(force(0.0, 9.8)));
        // A street of 15 degrees.
        assert!(learned.accept(force(2.54, 9.47)));
        let before = learned;
        assert!(!learned.accept(force(6.0, 7.7)));
        assert_eq!(learned, before);
    }
}
