//! The configuration of a DSP-1760 holds the settings that its messages do not state: without them rotation and time
//! cannot be computed.

/// Says whether a rotation is an increment or a rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rotation {
    /// Rotations are angles since the last message; this is the part's default, and better, since no turn between
    /// messages is lost.
    #[default]
    Delta,
    /// Rotations are angular rates.
    Rate,
}

/// Gives the unit of the rotation.
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

/// Holds the number of messages per second, one of those that the part offers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputRate(u16);

impl OutputRate {
    /// The rates that the part offers.
    pub const OFFERED: [u16; 10] = [1, 5, 10, 25, 50, 100, 250, 500, 750, 1000];
    /// The part sends 1000 messages a second.
    pub const HZ_1000: Self = Self(1000);

    /// Makes a rate; `None` when the part does not offer it.
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

/// Holds the settings that the messages do not state.
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
    /// The default is 1000 messages a second, otherwise as the part is delivered.
    pub const DEFAULT: Self = Self {
        rate: OutputRate::HZ_1000,
        rotation: Rotation::Delta,
        angle: AngleUnit::Radians,
        temperature: TemperatureUnit::Whole,
    };
}
