//! These types are the configuration of a coprocessor, and the errors of its inputs.

use super::clock::Clock;
use crate::align::AlignError;
use crate::align::clock::ClockError;
use crate::can;
use crate::can::wheel::{WheelError, WheelReceiver};
use crate::can::yaw::FOG_IDS;
use crate::fog::FogConfig;
use crate::heading::{HeadingError, HeadingReceiver};
use crate::pipeline::PipelineConfig;
use crate::units::Duration;

/// Stored data that was found damaged at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StorageFaults {
    /// Weights, configuration or calibration are damaged; the messages report it.
    pub damaged: bool,
    /// The configuration is lost and the built-in one is used: no rate is better than degraded.
    pub configuration_lost: bool,
}

/// Configures a coprocessor.
#[derive(Debug, Clone, Copy)]
pub struct Config {
    /// Settings of the pipeline that turns inertial samples into rates.
    pub pipeline: PipelineConfig,
    /// The messages that are sent for each sample.
    pub can: can::config::Config,
    /// The receiver of the vehicle's wheel speeds; `None` where none are sent.
    pub wheels: Option<WheelReceiver>,
    /// Settings of the pipeline that turns the fibre-optic gyro's samples into rates.
    pub fog: FogConfig,
    /// The receiver of the vehicle's course, speed over ground and latitude; `None` where none is sent.
    pub heading: Option<HeadingReceiver>,
    /// Identifiers (11 bits) of the fibre-optic gyro's messages: rate, angle, detail.
    pub fog_ids: [u16; 3],
    /// True if a fibre-optic gyro is fitted: its messages are sent, and its silence reported, from the start.
    pub fog_expected: bool,
    /// The caller runs GyroNet. Without it no window is due, and the messages report damaged data.
    pub has_gyronet: bool,
    /// The clock that `now` comes from.
    pub clock: Clock,
    /// An outside clock is a crystal's, against which those of the sensors are measured.
    pub clock_is_exact: bool,
    /// Stored data that was found damaged.
    pub storage: StorageFaults,
}

impl Config {
    /// A MEMS part on a car, x forward, y left, z up; the Bosch set and our own messages; no wheels.
    pub const DEFAULT: Self = Self {
        pipeline: PipelineConfig::DEFAULT,
        can: can::config::Config::DEFAULT,
        wheels: None,
        fog: FogConfig::DEFAULT,
        heading: None,
        fog_ids: FOG_IDS,
        fog_expected: false,
        has_gyronet: true,
        clock: Clock::Outside,
        clock_is_exact: false,
        storage: StorageFaults { damaged: false, configuration_lost: false },
    };
}

impl Default for Config {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum InputError {
    /// `now` is before the newest time; later times continue from the newest time.
    #[error("the clock went back by {} us", .by.0)]
    ClockWentBack { by: Duration },
    #[error("inertial sensor: {0}")]
    Imu(#[source] AlignError),
    #[error("fibre-optic gyro: {0}")]
    Fog(#[source] ClockError),
    #[error("wheel speeds: {0}")]
    Wheels(#[source] WheelError),
    #[error("{0}")]
    Heading(#[source] HeadingError),
    #[error("no window waits for estimate {end}")]
    NoWindow {
        /// The sample that the window ended with, or the number of FoGNet's window.
        end: u32,
    },
}
