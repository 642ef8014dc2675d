//! The configuration of a DSP-1760 holds the settings that its messages do not contain, but that are needed to
//! compute rotation and time.

/// The kind of a rotation: an increment or a rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rotation {
    /// Rotations are angles since the last message. This is the gyro's default, and better, because no rotation
    /// between messages is lost.
    #[default]
    Delta,
    /// Rotations are angular rates.
    Rate,
}

/// The unit of the rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AngleUnit {
    /// rad or rad/s; the gyro's default.
    #[default]
    Radians,
    /// deg or deg/s.
    Degrees,
}

/// The unit of the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TemperatureUnit {
    /// deg C; the gyro's default.
    #[default]
    Whole,
    /// 1/100 deg C.
    Hundredths,
}

/// The number of messages per second, one of [`OutputRate::OFFERED`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputRate(u16);

impl OutputRate {
    /// Rates that the gyro offers, messages per second.
    pub const OFFERED: [u16; 10] = [1, 5, 10, 25, 50, 100, 250, 500, 750, 1000];
    /// 1000 messages per second.
    pub const HZ_1000: Self = Self(1000);

    /// Creates a rate; `None` if the gyro does not offer it.
    pub fn new(hertz: u16) -> Option<Self> {
        Self::OFFERED.contains(&hertz).then_some(Self(hertz))
    }

    /// Returns the number of messages per second.
    #[must_use]
    pub const fn hertz(self) -> u16 {
        self.0
    }
}

/// The settings that the messages do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dsp1760Config {
    /// Messages per second.
    pub rate: OutputRate,
    /// Increments or rates.
    pub rotation: Rotation,
    /// Radians or degrees.
    pub angle: AngleUnit,
    /// Unit of the temperature.
    pub temperature: TemperatureUnit,
}

impl Dsp1760Config {
    /// The factory settings of the gyro, at 1000 messages per second.
    pub const DEFAULT: Self = Self {
        rate: OutputRate::HZ_1000,
        rotation: Rotation::Delta,
        angle: AngleUnit::Radians,
        temperature: TemperatureUnit::Whole,
    };
}
