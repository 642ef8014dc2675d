//! The configuration of a DSP-1760 holds what its bytes do not say.

/// Rotation as increment or as rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rotation {
    /// Angle since the last message; the part's default, and better: nothing is lost between.
    #[default]
    Delta,
    /// Angular rate.
    Rate,
}

/// Unit of the rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AngleUnit {
    /// rad or rad/s; the part's default.
    #[default]
    Radians,
    /// deg or deg/s.
    Degrees,
}

/// Unit of the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TemperatureUnit {
    /// deg C; the part's default.
    #[default]
    Whole,
    /// 1/100 deg C.
    Hundredths,
}

/// Messages per second, one of those that the part offers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputRate(u16);

impl OutputRate {
    /// The rates that the part offers.
    pub const OFFERED: [u16; 10] = [1, 5, 10, 25, 50, 100, 250, 500, 750, 1000];
    /// 1000 a second.
    pub const HZ_1000: Self = Self(1000);

    /// Returns `None` when the part does not offer it.
    #[must_use]
    pub fn new(hertz: u16) -> Option<Self> {
        Self::OFFERED.contains(&hertz).then_some(Self(hertz))
    }

    /// Returns the number of messages per second.
    #[must_use]
    pub const fn hertz(self) -> u16 {
        self.0
    }
}

/// The settings that the bytes do not contain.
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
    /// 1000 messages a second, otherwise as the part comes.
    pub const DEFAULT: Self = Self {
        rate: OutputRate::HZ_1000,
        rotation: Rotation::Delta,
        angle: AngleUnit::Radians,
        temperature: TemperatureUnit::Whole,
    };
}
