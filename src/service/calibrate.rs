//! A calibration at rest finds the gyro's bias, or the tilt of the sensor on level ground.
//!
//! Its result is in use only once it is stored.

use crate::bias::{Rest, StaticConfig, StaticError, StaticInit};
use crate::mounting::{LevelError, Rotation};
use crate::sample::{ImuSample, Standstill};
use crate::sqrt::sqrt;
use crate::standstill::Standing;
use crate::store::MAX_TILT_DEG;
use crate::store::{Level, Mounting};
use crate::units::{CentiCelsius, SpecificForce};
use serde::{Deserialize, Serialize};

/// The kind of calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Task {
    /// The gyro's bias, while the vehicle stands.
    Static,
    /// Roll and pitch of the sensor, while the vehicle stands on level ground.
    Mounting,
}

/// The reason why a calibration has failed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CalibrationFault {
    /// The vehicle moved, as detected by gyro axis 0 to 2, accelerometer axis 3 to 5 (x, y, z), or 6, the wheels.
    Moving(u8),
    /// The sensor was saturated.
    Clipped,
    /// The tilt from level, deg, is above 45: the configured rotation is wrong.
    Tilted(f32),
    /// The mean specific force, m/s^2, is not gravity.
    NotGravity(f32),
}

/// The progress of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// No calibration was requested.
    #[default]
    Idle,
    /// The calibration is collecting samples.
    Running(Task),
    /// The calibration has a result, which is not stored yet.
    Found(Task),
    /// The calibration has failed; the previous values are kept.
    Failed(Task, CalibrationFault),
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Finding {
    /// The readings at rest, and the temperature.
    Static(Rest, Option<CentiCelsius>),
    Mounting(Level),
}

#[derive(Debug, Clone)]
pub(crate) struct Calibrator {
    task: Task,
    still: StaticInit,
}

impl Calibrator {
    /// Starts a calibration.
    pub fn new(task: Task, limits: StaticConfig) -> Self {
        Self { task, still: StaticInit::new(limits) }
    }

    /// Returns the kind of calibration.
    pub const fn task(&self) -> Task {
        self.task
    }

    /// Adds a sample and what shows that the vehicle stands; with the last one, returns the mean readings at rest.
    pub fn add(
        &mut self,
        sample: &ImuSample,
        standing: &Standing,
        wheels: Standstill,
    ) -> Option<Result<Rest, CalibrationFault>> {
        if wheels == Standstill::Moving || standing.is_contradicted {
            return Some(Err(fault(StaticError::Wheels)));
        }
        if !sample.validity.is_good() {
            return Some(Err(CalibrationFault::Clipped));
        }
        let judged = self.still.add(sample, standing.is_by_wheels(), false)?;
        Some(judged.map_err(fault))
    }
}

fn fault(error: StaticError) -> CalibrationFault {
    CalibrationFault::Moving(match error {
        StaticError::GyroNoise { axis, .. }
        | StaticError::GyroDrift { axis, .. }
        | StaticError::GyroBias { axis, .. } => axis,
        StaticError::AccelNoise { axis, .. } | StaticError::AccelDrift { axis, .. } => 3 + axis,
        StaticError::Wheels => 6,
        StaticError::Level(LevelError::UpsideDown(tilt)) => return CalibrationFault::Tilted(tilt),
        StaticError::Level(LevelError::NotGravity(force)) => return CalibrationFault::NotGravity(force),
    })
}

/// Returns roll and pitch from gravity, after the configured rotation.
pub(crate) fn level(force: [SpecificForce; 3], mounting: &Mounting) -> Result<Level, CalibrationFault> {
    // The angles are finite: they have been checked.
    let rotation = mounting.rotation().unwrap_or(Rotation::IDENTITY);
    let [x, y, z] = rotation.force(force).map(|axis| axis.0 as f32);
    let roll_deg = libm::atan2f(y, z).to_degrees();
    let pitch_deg = libm::atan2f(-x, sqrt(y * y + z * z)).to_degrees();
    let worst = libm::fabsf(roll_deg).max(libm::fabsf(pitch_deg));
    if worst > MAX_TILT_DEG {
        Err(CalibrationFault::Tilted(worst))
    } else {
        Ok(Level { roll_deg, pitch_deg })
    }
}
