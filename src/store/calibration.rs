//! A calibration holds what measurements on request have shown about the board's own sensor: level and gain.

use super::error::{Field, FieldError, within};
use super::record::Record;
use crate::mounting::{GyroMap, Rotation};
use serde::{Deserialize, Serialize};

/// Furthest from level that a mounting calibration may find, deg; more is a wrong rotation.
pub(crate) const MAX_TILT_DEG: f32 = 45.0;

/// Holds the tilt of the configured sensor frame against level ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Level {
    /// Tilt about x, deg.
    pub roll_deg: f32,
    /// Tilt about y, deg.
    pub pitch_deg: f32,
}

impl Level {
    /// Returns the rotation from the configured frame into the vehicle's; `None` when an angle is not finite.
    #[must_use]
    pub fn rotation(&self) -> Option<Rotation> {
        Rotation::from_mounting(self.roll_deg, self.pitch_deg, 0.0)
    }
}

/// Holds gain and mounting of the unit's gyro, as a drive with a reference yaw rate has shown them
/// (`gyronet calibrate`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnitMap {
    /// The map.
    pub gyro_map: GyroMap,
    /// The checksum of the weights that corrected the drive; the map leaves out the errors that these weights correct.
    pub weights: u32,
}

/// Holds the level and the unit's map, as far as calibrations have found them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Calibration {
    /// The result of the last mounting calibration.
    pub level: Option<Level>,
    /// The result of a calibration against a reference yaw rate.
    pub unit: Option<UnitMap>,
}

impl Calibration {
    /// This calibration is that of an unknown sensor.
    pub const NONE: Self = Self { level: None, unit: None };

    /// Returns the map for a board that runs these weights; `None` if no map is stored, or one for other weights.
    #[must_use]
    pub fn gyro_map(&self, weights: u32) -> Option<GyroMap> {
        self.unit.filter(|unit| unit.weights == weights).map(|unit| unit.gyro_map)
    }
}

impl Record for Calibration {
    const KEY: u8 = 2;
    const VERSION: u8 = 3;

    fn check(&self) -> Result<(), FieldError> {
        if let Some(Level { roll_deg, pitch_deg }) = self.level {
            within(Field::CalibrationRollDeg, roll_deg, -MAX_TILT_DEG, MAX_TILT_DEG)?;
            within(Field::CalibrationPitchDeg, pitch_deg, -MAX_TILT_DEG, MAX_TILT_DEG)?;
        }
        if self.unit.is_some_and(|unit| !unit.gyro_map.is_plausible()) {
            return Err(FieldError::Implausible(Field::CalibrationGyroMap));
        }
        Ok(())
    }
}
