//! A calibration holds the results of measurements on request for the board's own sensor: level, gain and
//! misalignment.

use super::error::{Field, FieldError, within};
use super::record::Record;
use crate::mounting::{GyroMap, Rotation};
use serde::{Deserialize, Serialize};

/// The tilt of the configured sensor frame against level ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Level {
    /// Tilt about x, deg.
    pub roll_deg: f32,
    /// Tilt about y, deg.
    pub pitch_deg: f32,
}

impl Level {
    /// Returns the rotation from the configured frame to the vehicle's; `None` if an angle is not finite.
    pub fn rotation(&self) -> Option<Rotation> {
        Rotation::from_mounting(self.roll_deg, self.pitch_deg, 0.0)
    }
}

/// The gain and misalignment of the unit's gyro, determined from a drive with a reference yaw rate
/// (`gyronet calibrate`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnitMap {
    /// Matrix of gain and misalignment.
    pub gyro_map: GyroMap,
    /// Checksum of the weights that corrected the drive; the map excludes the errors that these weights correct.
    pub weights: u32,
}

/// The results of calibrations, each `None` until determined: the level and the unit's map.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Calibration {
    /// Result of the last mounting calibration.
    pub level: Option<Level>,
    /// Result of the last calibration against a reference yaw rate.
    pub unit: Option<UnitMap>,
}

impl Calibration {
    /// Calibration of an unknown sensor.
    pub const NONE: Self = Self { level: None, unit: None };

    /// Returns the map for a board that runs these weights; `None` if no map is stored, or only one for other
    /// weights.
    pub fn gyro_map(&self, weights: u32) -> Option<GyroMap> {
        self.unit.filter(|unit| unit.weights == weights).map(|unit| unit.gyro_map)
    }
}

impl Record for Calibration {
    const KEY: u8 = 2;
    const VERSION: u8 = 3;

    fn check(&self) -> Result<(), FieldError> {
        if let Some(Level { roll_deg, pitch_deg }) = self.level {
            within(Field::CalibrationRollDeg, roll_deg)?;
            within(Field::CalibrationPitchDeg, pitch_deg)?;
        }
        if self.unit.is_some_and(|unit| !unit.gyro_map.is_plausible()) {
            return Err(FieldError::Implausible(Field::CalibrationGyroMap));
        }
        Ok(())
    }
}
