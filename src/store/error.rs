//! Defines the errors of the store, in terms that a user can act on.

use crate::can::config::ConfigError;
use crate::can::wheel::WheelConfigError;
use crate::heading::HeadingConfigError;
use serde::{Deserialize, Serialize};

/// A value of a record that has a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "named as the fields that they stand for")]
pub enum Field {
    LatitudeDeg,
    FogTiltDeg,
    MountingRollDeg,
    MountingPitchDeg,
    MountingYawDeg,
    StaticGyroStd,
    StaticAccelStd,
    StaticGyroDrift,
    StaticAccelDrift,
    StaticGyroBias,
    CalibrationGyroMap,
    ThermalBias,
    Forward,
    Vertical,
    Gain,
}

impl Field {
    /// Name as a user writes it; smallest and largest valid value, or `None` for a value that is checked in another way.
    const fn limits(self) -> (&'static str, Option<[f32; 2]>) {
        match self {
            Self::LatitudeDeg => ("latitude_deg", Some([-90.0, 90.0])),
            Self::FogTiltDeg => ("fog_gyro.tilt_deg", Some([0.0, 45.0])),
            Self::MountingRollDeg => ("mounting.roll_deg", Some([-180.0, 180.0])),
            Self::MountingPitchDeg => ("mounting.pitch_deg", Some([-90.0, 90.0])),
            Self::MountingYawDeg => ("mounting.yaw_deg", Some([-180.0, 180.0])),
            // Below the noise of a quiet part, static initialisation would never end.
            Self::StaticGyroStd => ("static_init.gyro_std", Some([5e-4, 1.0])),
            Self::StaticAccelStd => ("static_init.accel_std", Some([5e-3, 20.0])),
            Self::StaticGyroDrift => ("static_init.gyro_drift", Some([2e-4, 0.1])),
            Self::StaticAccelDrift => ("static_init.accel_drift", Some([1e-3, 2.0])),
            Self::StaticGyroBias => ("static_init.gyro_bias", Some([5e-4, 1.0])),
            Self::CalibrationGyroMap => ("gyro_map", None),
            Self::ThermalBias => ("thermal_bias", None),
            Self::Forward => ("forward", None),
            Self::Vertical => ("vertical", None),
            Self::Gain => ("gain", None),
        }
    }

    /// Returns the name of the field as a user writes it.
    pub const fn name(self) -> &'static str {
        self.limits().0
    }

    /// Smallest and largest valid value; `None` for a value that is checked in another way.
    pub const fn range(self) -> Option<[f32; 2]> {
        self.limits().1
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum FieldError {
    #[error("{}: {value} is not within {low} to {high}", .field.name())]
    Range { field: Field, value: f32, low: f32, high: f32 },
    #[error("{}: not plausible for any sensor", .0.name())]
    Implausible(Field),
    #[error("can: {0}")]
    Can(ConfigError),
    #[error("heading: {0}")]
    Heading(HeadingConfigError),
    #[error("wheels: {0}")]
    Wheels(WheelConfigError),
    #[error("sensor: this firmware image does not drive the part")]
    PartNotInImage,
    #[error("compensate.stride: a window of the weights takes {cycles} cycles, and it leaves {available}")]
    Window { cycles: u32, available: u32 },
    #[error("diagnosis: identifier {0:#x} has too many bits, or is used twice")]
    Diagnosis(u32),
    #[error("heading.line: the board has no line for a GNSS receiver")]
    NoLine,
    #[error("can.yaw.fd: the board's controller has no CAN FD")]
    NoFd,
}

pub(super) fn within(field: Field, value: f32) -> Result<(), FieldError> {
    let [low, high] = field.range().ok_or(FieldError::Implausible(field))?;
    // NaN is inside no range.
    if (low..=high).contains(&value) { Ok(()) } else { Err(FieldError::Range { field, value, low, high }) }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum FlashFault {
    #[error("not the start of a word or sector")]
    NotAligned,
    #[error("beyond its end")]
    OutOfBounds,
    #[error("did not take or finish the operation")]
    Refused,
    #[error("its controller is unlocked although no operation runs")]
    Unlocked,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum StoreError {
    #[error("the board has no flash that it may write: nothing can be stored")]
    NoFlash,
    #[error("flash: {0}")]
    Flash(FlashFault),
    #[error("no room is left for the record")]
    Full,
    #[error("the record has layout {found}, this firmware reads {expected}")]
    Version { found: u8, expected: u8 },
    #[error("the record does not decode as its layout version requires")]
    Encoding,
    #[error(transparent)]
    Field(#[from] FieldError),
    #[error("the board was reset three times within a minute of its start")]
    Resets,
    #[error("the record was damaged, and none has been stored since")]
    Lost,
}
