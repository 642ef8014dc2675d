//! A calibration at rest finds the gyro's bias, or the tilt of the sensor on level ground.

use crate::bias::{Rest, StaticConfig, StaticError, StaticInit};
use crate::mounting::{LevelError, Rotation};
use crate::sample::ImuSample;
use crate::store::calibration::MAX_TILT_DEG;
use crate::store::{Level, Mounting};
use crate::units::SpecificForce;
use serde::{Deserialize, Serialize};

/// The result that a calibration looks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Task {
    /// The gyro's bias; the vehicle stands.
    Static,
    /// Roll and pitch of the sensor; the vehicle stands on level ground.
    Mounting,
}

/// The reason why a calibration has found nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CalibrationFault {
    /// The vehicle moved; the axis that gave it away: 0 to 2 gyro, 3 to 5 accelerometer,
    /// 6 the wheels.
    Moving(u8),
    /// The part was saturated.
    Clipped,
    /// More than 45 deg from level: the configured rotation is wrong, deg.
    Tilted(f32),
    /// The mean specific force is not gravity, m/s^2.
    NotGravity(f32),
}

/// The progress of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// No calibration was requested.
    #[default]
    Idle,
    /// Collecting samples.
    Running(Task),
    /// Found; not stored yet.
    Found(Task),
    /// Found nothing; what was known before is kept.
    Failed(Task, CalibrationFault),
}

/// A calibration under way.
#[derive(Debug, Clone)]
pub(crate) struct Calibrator {
    task: Task,
    still: StaticInit,
}

impl Calibrator {
    /// Starts collecting.
    #[must_use]
    pub fn new(task: Task, limits: StaticConfig) -> Self {
        Self { task, still: StaticInit::new(limits) }
    }

    /// Returns the calibration that is under way.
    #[must_use]
    pub const fn task(&self) -> Task {
        self.task
    }

    /// Takes a sample; with the last one returns the readings at rest.
    pub fn add(&mut self, sample: &ImuSample) -> Option<Result<Rest, CalibrationFault>> {
        if !sample.validity.is_good() {
            return Some(Err(CalibrationFault::Clipped));
        }
        let judged = self.still.add(sample)?;
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

/// Returns the roll and pitch that gravity shows, after the configured rotation.
pub(crate) fn level(force: [SpecificForce; 3], mounting: &Mounting) -> Result<Level, CalibrationFault> {
    // The angles have been checked to be finite.
    let rotation = mounting.rotation().unwrap_or(Rotation::IDENTITY);
    let [x, y, z] = rotation.force(force).map(|axis| axis.0 as f32);
    let roll_deg = libm::atan2f(y, z).to_degrees();
    let pitch_deg = libm::atan2f(-x, crate::root::sqrt(y * y + z * z)).to_degrees();
    let worst = libm::fabsf(roll_deg).max(libm::fabsf(pitch_deg));
    if worst > MAX_TILT_DEG {
        Err(CalibrationFault::Tilted(worst))
    } else {
        Ok(Level { roll_deg, pitch_deg })
    }
}
