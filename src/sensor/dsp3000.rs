//! These modules read the KVH DSP-3000, a fibre-optic gyro with one axis, in its two variants.
//!
//! One ([`ascii`]) sends 100 lines a second at 38400 8N1, `[-]ddd.dddddd y`; the other
//! ([`binary`]) 1000 words of four bytes a second at 115200 8N1.
//!
//! Neither carries time or a counter, so a lost reading leaves no trace in the bytes: the
//! arrival times tell. The part's rate is its own within some 3 %; the readings belong on the
//! grid by their arrival ([`crate::align`]), not by their number.
//!
//! Rotation of the Earth, 15.04 deg/h times the sine of the latitude, is in the reading and is
//! 300 times the part's bias. It is left in: the bias stage takes it off, once.

pub mod ascii;
pub mod binary;

use crate::sample::FogSample;
use crate::units::{Angle, Micros};

/// The meaning of the number; it is set at the part with one letter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Angular rate.
    Rate,
    /// Angle since the last reading.
    Incremental,
    /// Angle since the start or since it was zeroed.
    Integrated,
}

/// The commands of the part, one letter each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Send this kind of number.
    Mode(Mode),
    /// The integrated angle is zero now.
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

    /// Returns the command of a letter, if it is one.
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

/// Makes a sample of a rate or an increment, in degrees, over the time before `now`. The part's only axis is the
/// vertical one.
fn sample(mode: Mode, degrees: f32, valid: bool, now: Micros, span: u32) -> Option<FogSample> {
    let per_second = match mode {
        Mode::Rate => span as f32 * 1e-6,
        Mode::Incremental => 1.0,
        Mode::Integrated => return None,
    };
    let angle = Angle::from_rad((degrees * per_second).to_radians()).ok().filter(|_| valid);
    Some(FogSample { time: now, span, lost: 0, increment: [None, None, angle], temperature: None })
}
