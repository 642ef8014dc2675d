//! The commands of the DSP-1760 are lines of ASCII, ended by LF.
//!
//! Settings are accepted only in configuration mode. Whether the gyro sends radians or degrees is
//! set in the gyro and cannot be read from a frame; we know of no command for it.

use super::{Dsp1760Config, OutputRate, Rotation, TemperatureUnit};
use core::fmt::Write;
use heapless::String;

/// Length of the longest line, bytes.
pub const MAX_LINE: usize = 20;

/// A command to the gyro: one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Enters (true) or leaves configuration mode.
    Configure(bool),
    /// Sets the message rate. The two messages after the change are invalid.
    Rate(OutputRate),
    /// Selects increments or rates as rotations.
    Rotation(Rotation),
    /// Restores the gyro's default for rotations.
    ResetRotation,
    /// Sets the unit of the temperature field.
    Temperature(TemperatureUnit),
    /// Requests the message rate; the answer is [`Reply::Rate`].
    QueryRate,
}

impl Command {
    /// Encodes the line, LF included.
    #[must_use]
    pub fn emit(&self) -> String<MAX_LINE> {
        let mut line = String::new();
        // MAX_LINE bytes hold every line.
        let _ = match self {
            Self::Configure(on) => write!(line, "=config,{}", u8::from(*on)),
            Self::Rate(rate) => write!(line, "=dr,{}", rate.hertz()),
            Self::Rotation(Rotation::Delta) => line.write_str("=rotfmt,delta"),
            Self::Rotation(Rotation::Rate) => line.write_str("=rotfmt,rate"),
            Self::ResetRotation => line.write_str("=rotfmt,reset"),
            Self::Temperature(TemperatureUnit::Whole) => line.write_str("=tempunits,C"),
            Self::Temperature(TemperatureUnit::Hundredths) => line.write_str("=tempunits,C_100"),
            Self::QueryRate => line.write_str("?DR"),
        };
        let _ = line.push('\n');
        line
    }

    /// Parses a line as the gyro does: case and surrounding blanks do not matter.
    #[must_use]
    pub fn parse(line: &[u8]) -> Option<Self> {
        let line = core::str::from_utf8(line).ok()?.trim();
        if line.eq_ignore_ascii_case("?dr") {
            return Some(Self::QueryRate);
        }
        let (name, value) = line.strip_prefix('=')?.split_once(',')?;
        let is = |word| value.eq_ignore_ascii_case(word);
        if name.eq_ignore_ascii_case("config") {
            return if is("1") {
                Some(Self::Configure(true))
            } else {
                is("0").then_some(Self::Configure(false))
            };
        }
        if name.eq_ignore_ascii_case("dr") {
            return value.parse().ok().and_then(OutputRate::new).map(Self::Rate);
        }
        let choices: &[(&str, &str, Self)] = &[
            ("rotfmt", "delta", Self::Rotation(Rotation::Delta)),
            ("rotfmt", "rate", Self::Rotation(Rotation::Rate)),
            ("rotfmt", "reset", Self::ResetRotation),
            ("tempunits", "c", Self::Temperature(TemperatureUnit::Whole)),
            ("tempunits", "c_100", Self::Temperature(TemperatureUnit::Hundredths)),
        ];
        choices.iter().find(|(n, v, _)| name.eq_ignore_ascii_case(n) && is(v)).map(|(.., command)| *command)
    }
}

/// Returns the commands that configure a gyro, in order. The gyro sends no messages meanwhile. [`super::dialogue`]
/// sends the commands and checks that they took effect.
#[must_use]
pub const fn setup(config: &Dsp1760Config) -> [Command; 5] {
    [
        Command::Configure(true),
        Command::Rate(config.rate),
        Command::Rotation(config.rotation),
        Command::Temperature(config.temperature),
        Command::Configure(false),
    ]
}

/// A reply line from the gyro.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reply {
    /// Messages per second.
    Rate(OutputRate),
}

impl Reply {
    /// Parses a line such as `DR,1000`; `None` for any other.
    #[must_use]
    pub fn parse(line: &[u8]) -> Option<Self> {
        let (name, value) = core::str::from_utf8(line).ok()?.trim().split_once(',')?;
        let rate = || value.parse().ok().and_then(OutputRate::new).map(Self::Rate);
        if name.eq_ignore_ascii_case("dr") { rate() } else { None }
    }

    /// Encodes the line, CR and LF included.
    #[must_use]
    pub fn emit(&self) -> String<MAX_LINE> {
        let mut line = String::new();
        let Self::Rate(rate) = self;
        let _ = write!(line, "DR,{}\r\n", rate.hertz());
        line
    }
}
