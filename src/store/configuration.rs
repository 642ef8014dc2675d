//! The configuration holds everything that a user sets. It is checked when stored and when read, so code that uses it
//! needs no checks.

use super::error::{Field, FieldError, within};
use super::record::Record;
use super::{Calibration, Learned};
use crate::bias::{EarthRate, Latitude, StaticConfig};
use crate::can::config::{Config, Settings};
use crate::can::diagnosis::DiagnosisIds;
use crate::can::identifier;
use crate::can::wheel::{WheelConfigError, WheelReceiver, WheelSettings};
use crate::can::yaw::FOG_IDS;
use crate::compensate::CompensateConfig;
use crate::coprocessor;
use crate::fog::{FogConfig, Tilt};
use crate::heading::{Gain, HeadingReceiver, HeadingSettings};
use crate::mounting::{GyroMap, Rotation};
use crate::pipeline::PipelineConfig;
use embedded_can::{Id, StandardId};
use serde::{Deserialize, Serialize};

/// The inertial sensor that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ImuPart {
    /// Xsens MTi, MTData2 on a UART.
    XsensMti,
    /// TDK ICM-42688-P on SPI.
    Icm42688,
    /// Bosch BMI088 on SPI, with two chip selects.
    Bmi088,
    /// ST ASM330LHH on SPI.
    Asm330lhh,
}

/// The fibre-optic gyro that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FogPart {
    /// KVH DSP-1760 or 17xx.
    Dsp1760,
}

/// The rotation of the sensor against the vehicle: about x (forward), then y (left), then z (up).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mounting {
    /// Rotation about x, -180 to 180 deg.
    pub roll_deg: f32,
    /// Rotation about y, -90 to 90 deg.
    pub pitch_deg: f32,
    /// Rotation about z, -180 to 180 deg.
    pub yaw_deg: f32,
}

impl Mounting {
    /// Returns the rotation from the sensor's axes to the vehicle's; `None` if an angle is not finite.
    pub fn rotation(&self) -> Option<Rotation> {
        Rotation::from_mounting(self.roll_deg, self.pitch_deg, self.yaw_deg)
    }
}

/// The settings of the correction of the fibre-optic gyro.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FogGyro {
    /// Angle between the axis of the gyro and the vertical of the level vehicle, 0 to 45 deg.
    pub tilt_deg: f32,
}

/// The complete configuration; a change takes effect at the next start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// Inertial sensor that is fitted.
    pub imu: ImuPart,
    /// Fibre-optic gyro, if one is fitted.
    pub fog: Option<FogPart>,
    /// Messages on the CAN bus: identifiers, periods, protection.
    pub can: Settings,
    /// Latitude, -90 to 90 deg, north positive. With `None` the Earth's rate stays in the bias, and the rate of a
    /// fibre-optic gyro is degraded until a latitude arrives as [`Configuration::heading`] says.
    pub latitude_deg: Option<f32>,
    /// Mounting of the sensor.
    pub mounting: Mounting,
    /// Limits within which the vehicle counts as standing.
    pub static_init: StaticConfig,
    /// Stride, lag and limits of the correction.
    pub compensate: CompensateConfig,
    /// Identifiers (11 bits) of the fibre-optic gyro's messages: rate, angle, detail.
    pub fog_ids: [u16; 3],
    /// Correction of the fibre-optic gyro.
    pub fog_gyro: FogGyro,
    /// Where the vehicle's course, speed over ground and latitude come from, from which bias and gain are learnt in motion.
    pub heading: HeadingSettings,
    /// Identifiers of diagnosis.
    pub diagnosis: DiagnosisIds,
    /// True if the board learns the sensor's bias over temperature and the forward direction, and uses them.
    pub learn: bool,
}

impl Configuration {
    /// Default: an Xsens MTi, mounted level in a car; the Bosch set and our own messages are sent.
    pub const DEFAULT: Self = Self {
        imu: ImuPart::XsensMti,
        fog: None,
        can: Settings::DEFAULT,
        latitude_deg: None,
        mounting: Mounting { roll_deg: 0.0, pitch_deg: 0.0, yaw_deg: 0.0 },
        static_init: StaticConfig::DEFAULT,
        compensate: CompensateConfig::DEFAULT,
        fog_ids: FOG_IDS,
        fog_gyro: FogGyro { tilt_deg: 0.0 },
        heading: HeadingSettings::NONE,
        diagnosis: DiagnosisIds::DEFAULT,
        learn: true,
    };
}

impl Configuration {
    /// Returns the pipeline's configuration; the calibration's map is used only with the weights it was found with.
    pub fn pipeline(&self, calibration: &Calibration, learned: &Learned, weights: u32) -> PipelineConfig {
        // The angles are finite: they have been checked.
        let mounting = self.mounting.rotation().unwrap_or(Rotation::IDENTITY);
        let learned = if self.learn { learned } else { &Learned::NOTHING };
        let gyro_map = calibration.gyro_map(weights).unwrap_or(GyroMap::IDENTITY);
        let elements = gyro_map.elements();
        let fold = |of: u32, element: &f32| of.rotate_left(5) ^ element.to_bits();
        let gain_of = elements.as_flattened().iter().fold(weights, fold);
        let gain = learned.gain.filter(|gain| gain.of == gain_of && self.heading != HeadingSettings::NONE);
        PipelineConfig {
            thermal_bias: learned.thermal_bias,
            rest_force: learned.specific_force,
            vertical: learned.vertical,
            mounting,
            forward: learned.forward_knowledge(&mounting),
            gyro_map,
            gain: gain.map(Gain::aged),
            gain_of,
            static_init: self.static_init,
            earth_rate: self.latitude().map_or(EarthRate::LeftInBias, EarthRate::Subtracted),
            compensate: self.compensate,
            ..PipelineConfig::DEFAULT
        }
    }
}

impl Configuration {
    /// Returns the default with this one's identifiers and messages, which other nodes know; it learns nothing.
    #[cfg(feature = "service")]
    pub(crate) fn bus_alone(&self) -> Self {
        let Self { can, fog_ids, diagnosis, .. } = *self;
        Self { can, fog_ids, diagnosis, learn: false, ..Self::DEFAULT }
    }

    fn latitude(&self) -> Option<Latitude> {
        self.latitude_deg.and_then(Latitude::from_degrees)
    }

    /// Returns the first of these identifiers that is also that of one of the board's own messages.
    pub(crate) fn own_identifier(&self, mut ids: impl Iterator<Item = Id>) -> Option<Id> {
        let can = Config::new(self.can).ok()?;
        let fog = self.fog_ids.map(|id| StandardId::new(id).map(Id::Standard));
        ids.find(|id| can.sends(*id) || fog.contains(&Some(*id)))
    }

    /// Checks that the identifier of no wheel frame is that of a message that the board sends, or of diagnosis.
    pub fn check_wheels(&self, wheels: &WheelSettings) -> Result<(), FieldError> {
        let ids = || wheels.frames.iter().flatten().map(|frame| frame.id);
        let diagnosis = self.diagnosis.ids().map_err(FieldError::Diagnosis)?;
        let taken = ids().find(|id| diagnosis.contains(id)).or_else(|| self.own_identifier(ids()));
        taken.map_or(Ok(()), |id| Err(FieldError::Wheels(WheelConfigError::Own(identifier::raw(id)))))
    }

    fn fog(&self) -> FogConfig {
        FogConfig {
            latitude: self.latitude(),
            // A stored configuration has been checked.
            tilt: Tilt::from_degrees(self.fog_gyro.tilt_deg).unwrap_or(Tilt::NONE),
            ..FogConfig::DEFAULT
        }
    }

    /// Returns a coprocessor's configuration for these weights, to which the board adds what only it knows.
    pub fn coprocessor(
        &self,
        calibration: &Calibration,
        learned: &Learned,
        weights: u32,
    ) -> coprocessor::Config {
        coprocessor::Config {
            pipeline: self.pipeline(calibration, learned, weights),
            // A stored configuration has been checked.
            can: Config::new(self.can).unwrap_or(Config::DEFAULT),
            fog_ids: self.fog_ids,
            fog_expected: self.fog.is_some(),
            fog: self.fog(),
            heading: (self.heading != HeadingSettings::NONE)
                .then(|| HeadingReceiver::new(self.heading, self.latitude_deg)),
            ..coprocessor::Config::DEFAULT
        }
    }
}

impl Record for Configuration {
    const KEY: u8 = 1;
    const VERSION: u8 = 14;

    fn check(&self) -> Result<(), FieldError> {
        let config = Config::new(self.can).map_err(FieldError::Can)?;
        config.check_further(self.fog_ids).map_err(FieldError::Can)?;
        if self.fog.is_some() {
            config.check_further_load().map_err(FieldError::Can)?;
        }
        let ids = self.diagnosis.ids().map_err(FieldError::Diagnosis)?;
        let fog_ids = self.fog_ids.into_iter().filter_map(StandardId::new).map(Id::Standard);
        let messages = config.messages();
        let own = messages.iter().map(|message| message.id);
        self.heading.check(own.chain(fog_ids).chain(ids)).map_err(FieldError::Heading)?;
        if self.own_identifier(ids.into_iter()).is_some() {
            return Err(FieldError::Diagnosis(self.diagnosis.request));
        }
        let Mounting { roll_deg, pitch_deg, yaw_deg } = self.mounting;
        let StaticConfig { gyro_std, accel_std, gyro_drift, accel_drift, gyro_bias } = self.static_init;
        // Of `compensate` all lags are valid, and all strides that leave a window of the weights enough time: see the device.
        for (field, value) in [
            (Field::LatitudeDeg, self.latitude_deg.unwrap_or(0.0)),
            (Field::FogTiltDeg, self.fog_gyro.tilt_deg),
            (Field::MountingRollDeg, roll_deg),
            (Field::MountingPitchDeg, pitch_deg),
            (Field::MountingYawDeg, yaw_deg),
            (Field::StaticGyroStd, gyro_std),
            (Field::StaticAccelStd, accel_std),
            (Field::StaticGyroDrift, gyro_drift),
            (Field::StaticAccelDrift, accel_drift),
            (Field::StaticGyroBias, gyro_bias),
        ] {
            within(field, value)?;
        }
        Ok(())
    }
}

// Records of their own, so that another vehicle needs new settings instead of a new image.
impl Record for WheelSettings {
    const KEY: u8 = 4;
    const VERSION: u8 = 2;

    fn check(&self) -> Result<(), FieldError> {
        WheelReceiver::new(*self).map(drop).map_err(FieldError::Wheels)
    }
}
