//! Parsers of the two variants of the KVH DSP-3000, a single-axis fibre-optic gyro.
//!
//! One variant ([`ascii`]) sends 100 lines a second at 38400 baud 8N1, `[-]ddd.dddddd y`; the other
//! ([`binary`]) sends 1000 words of four bytes a second at 115200 baud 8N1.
//!
//! Neither carries a time stamp or a counter, so only the arrival times reveal a lost reading. The gyro's output rate
//! is off by up to about 3 %, so readings are placed on the grid by arrival time ([`crate::align`]), not by number.
//!
//! A reading includes the rotation of the Earth, 15.04 deg/h times the sine of the latitude, which is 300 times the
//! gyro's bias. It is not removed here, because the bias stage subtracts it.

pub mod ascii;
pub mod binary;

use crate::sample::FogSample;
use crate::units::{Angle, Micros};

/// The kind of number that the gyro sends; a one-letter command selects it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Angular rate.
    Rate,
    /// Angle since the last reading.
    Incremental,
    /// Angle since the start, or since the last [`Command::Zero`].
    Integrated,
}

/// The commands of the gyro, one letter each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Selects the kind of number that is sent.
    Mode(Mode),
    /// Sets the integrated angle to zero.
    Zero,
}

impl Command {
    /// Returns the letter.
    #[must_use]
    pub const fn emit(self) -> u8 {
        match self {
            Self::Mode(Mode::Rate) => b'R',
            Self::Mode(Mode::Incremental) => b'A',
            Self::Mode(Mode::Integrated) => b'P',
            Self::Zero => b'Z',
        }
    }

    /// Returns the command that a letter stands for, if any.
    #[must_use]
    pub const fn parse(letter: u8) -> Option<Self> {
        match letter {
            b'R' => Some(Self::Mode(Mode::Rate)),
            b'A' => Some(Self::Mode(Mode::Incremental)),
            b'P' => Some(Self::Mode(Mode::Integrated)),
            b'Z' => Some(Self::Zero),
            _ => None,
        }
    }
}

/// Creates the sample of a rate (deg/s) or an increment (deg) over the `span` microseconds before `now`. The gyro's
/// only axis is the vertical one.
fn sample(mode: Mode, degrees: f32, valid: bool, now: Micros, span: u32) -> Option<FogSample> {
    let per_second = match mode {
        Mode::Rate => span as f32 * 1e-6,
        Mode::Incremental => 1.0,
        Mode::Integrated => return None,
    };
    let angle = Angle::from_rad((degrees * per_second).to_radians()).ok().filter(|_| valid);
    Some(FogSample { time: now, span, lost: 0, increment: [None, None, angle], temperature: None })
}
