//! A calibration holds gain and misalignment of the board's own sensor.

use super::error::{Field, FieldError};
use super::record::Record;
use crate::mounting::GyroMap;
use serde::{Deserialize, Serialize};

/// The unit's gain and misalignment, from a drive with a reference yaw rate (`gyronet calibrate`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnitMap {
    /// Matrix of gain and misalignment.
    pub gyro_map: GyroMap,
    /// Checksum of the weights that corrected the drive; the map excludes the errors that these weights correct.
    pub weights: u32,
}

/// The result of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Calibration {
    /// Result of the last calibration against a reference yaw rate; `None` until there is one.
    pub unit: Option<UnitMap>,
}

impl Calibration {
    /// Calibration of an unknown sensor.
    pub const NONE: Self = Self { unit: None };

    /// Returns the map for these weights; `None` if none is stored, or one for other weights.
    pub fn gyro_map(&self, weights: u32) -> Option<GyroMap> {
        self.unit.filter(|unit| unit.weights == weights).map(|unit| unit.gyro_map)
    }
}

impl Record for Calibration {
    const KEY: u8 = 2;
    const VERSION: u8 = 4;

    fn check(&self) -> Result<(), FieldError> {
        if self.unit.is_some_and(|unit| !unit.gyro_map.is_plausible()) {
            return Err(FieldError::Implausible(Field::CalibrationGyroMap));
        }
        Ok(())
    }
}
