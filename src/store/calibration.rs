//! A calibration holds what measurements have shown about the board's own sensor: bias, level, gain.

use super::error::{Field, FieldError, within};
use super::record::Record;
use crate::mounting::{GyroMap, Rotation};
use crate::units::{AngularRate, CentiCelsius};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most points of the temperature table.
pub const MAX_POINTS: usize = 8;
/// Points less than this apart are merged, 1/100 deg C.
const POINT_SPACING: i16 = 500;
/// Largest believable bias, rad/s.
const MAX_BIAS: f32 = 1.0;
/// Parts are made for temperatures in this range, deg C.
const TEMPERATURE: (f32, f32) = (-60.0, 150.0);
/// Furthest from level that a mounting calibration may find, deg; more is a wrong rotation.
pub(crate) const MAX_TILT_DEG: f32 = 45.0;

/// Holds the gyro's bias at one temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BiasPoint {
    /// The temperature of the part.
    pub temperature: CentiCelsius,
    /// Bias about x, y, z.
    pub gyro_bias: [AngularRate; 3],
}

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

/// Holds the bias, its temperature table, the level and the unit's map, as far as calibrations have found them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Calibration {
    /// The result of the last static calibration.
    pub gyro_bias: Option<[AngularRate; 3]>,
    /// Rising temperatures, at least 5 deg C apart.
    pub temperature_table: Vec<BiasPoint, MAX_POINTS>,
    /// The result of the last mounting calibration.
    pub level: Option<Level>,
    /// The result of a calibration against a reference yaw rate.
    pub unit: Option<UnitMap>,
}

impl Calibration {
    /// This calibration is that of an unknown sensor.
    pub const NONE: Self = Self { gyro_bias: None, temperature_table: Vec::new(), level: None, unit: None };

    /// Returns the map for a board that runs these weights; `None` if no map is stored, or one for other weights.
    #[must_use]
    pub fn gyro_map(&self, weights: u32) -> Option<GyroMap> {
        self.unit.filter(|unit| unit.weights == weights).map(|unit| unit.gyro_map)
    }

    /// Stores the bias of a static calibration, and adds it to the table if the part reports its
    /// temperature. The new point replaces points that are nearer than 5 deg C; if there are none and
    /// the table is full, it replaces the nearest points.
    pub fn add_bias(&mut self, gyro_bias: [AngularRate; 3], temperature: Option<CentiCelsius>) {
        self.gyro_bias = Some(gyro_bias);
        let Some(temperature) = temperature else { return };
        let distance = |point: &BiasPoint| point.temperature.0.abs_diff(temperature.0);
        self.temperature_table.retain(|point| distance(point) >= POINT_SPACING.unsigned_abs());
        if self.temperature_table.is_full()
            && let Some(nearest) = self.temperature_table.iter().map(distance).min()
        {
            self.temperature_table.retain(|point| distance(point) != nearest);
        }
        // There is room: a full table has just lost a point.
        let _ = self.temperature_table.push(BiasPoint { temperature, gyro_bias });
        // All others are in order: one pass takes the new one to its place.
        for k in (1..self.temperature_table.len()).rev() {
            if let Some([low, high]) = self.temperature_table.get_mut(k - 1..=k)
                && low.temperature > high.temperature
            {
                core::mem::swap(low, high);
            }
        }
    }
}

impl Record for Calibration {
    const KEY: u8 = 2;
    const VERSION: u8 = 2;

    /// Returns the bytes that layout 1 lacks at its end, where `unit` was added.
    fn missing(version: u8) -> Option<&'static [u8]> {
        (version == 1).then_some(&[0])
    }

    fn check(&self) -> Result<(), FieldError> {
        let biases = self.gyro_bias.iter().chain(self.temperature_table.iter().map(|point| &point.gyro_bias));
        for rate in biases.flatten() {
            let rate = rate.0 as f32 / AngularRate::PER_RAD_PER_SEC;
            within(Field::CalibrationGyroBias, rate, -MAX_BIAS, MAX_BIAS)?;
        }
        let mut before = f32::NEG_INFINITY;
        for point in &self.temperature_table {
            let celsius = f32::from(point.temperature.0) / 100.0;
            let (low, high) = TEMPERATURE;
            within(Field::CalibrationTemperature, celsius, low, high)?;
            within(Field::CalibrationTemperatureOrder, celsius, before, high)?;
            before = celsius + f32::from(POINT_SPACING) / 100.0;
        }
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
