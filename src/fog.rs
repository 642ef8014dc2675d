//! Corrects the turns of a fibre-optic gyro, frame by frame: it subtracts the Earth's rate and the gyro's bias
//! (`earth_and_bias`). [`FogCorrector`] also subtracts FoGNet's estimate of the remaining error; it runs on
//! recordings.
//!
//! # FoGNet
//!
//! A window covers a minute, and a new one is due every second, so 60 windows cover each second. A window's estimate
//! is used in the second after next: a network has a second for it.
//!
//! Only the part of a correction that is linear in the gyro's increments (an error of scale) can be assigned to
//! seconds. So, with d a frame's increment, g the mean factor of the linear part, C the correction and L its linear
//! part:
//!
//! `corrected = d - g d - (C - L) / 6000`
//!
//! The rest is spread evenly over a window's length, so that each of 60 windows contributes a sixtieth. Both divisions
//! carry their remainders: the sum is exact. All of C spread evenly would come half a minute late after a turn;
//! differences between windows would be 60 interleaved sums of single estimates, each with its own error.

mod beside;
mod earth_and_bias;
mod part;
mod pipeline;
mod rate;
mod rest;

pub use beside::Beside;
pub use earth_and_bias::{EarthAndBias, Tilt};
pub use part::FogErrors;
pub use pipeline::{FogCounters, FogPipeline, STUCK_AFTER, STUCK_US};
pub use rate::IncrementRate;
pub use rest::{RestOutcome, RestReading};

use crate::bias::Latitude;
use crate::model::fognet::{FogEstimate, GAIN_FRACTION_BITS, MinuteNetwork};
use crate::model::seconds::{FRAMES, FogFrame, Incomplete, Minute, STEPS, SecondSums};
use crate::units::Angle;

/// A window's correction is spread over this many frames.
const WINDOW_FRAMES: i64 = STEPS as i64 * FRAMES as i64;
/// Largest plausible correction, 0.02 rad a minute: four times the Earth's share, with room for 0.1 % of scale error over
/// two full turns.
pub const MAX_CORRECTION: Angle = Angle((0.02 * Angle::PER_RAD as f64) as i64);

#[derive(Debug, Clone, Copy)]
pub struct FogConfig {
    pub errors: FogErrors,
    pub latitude: Option<Latitude>,
    pub tilt: Tilt,
    /// Vibration left in a second's mean rate, 1 sigma, rad/s, standing and moving: no turn, its sum is zero.
    pub shake: [f32; 2],
    /// The caller's clock is a crystal's, against which that of the gyro is measured.
    pub clock_is_exact: bool,
}

impl FogConfig {
    /// A level DSP-1760 on the simulated car of the training drives.
    pub const DEFAULT: Self = Self {
        errors: FogErrors::DSP1760,
        latitude: None,
        tilt: Tilt::NONE,
        shake: [6e-5, 1.56e-4],
        clock_is_exact: false,
    };
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FogOutput {
    /// The frame's turn less the correction.
    pub turn: Angle,
    pub correction: Angle,
    pub corrected: bool,
    /// A second is over and ends a window, whose estimate is known.
    pub is_window: bool,
    pub broken: bool,
    /// The estimate that was due is not used: its correction is too large.
    pub implausible: bool,
}

/// Applies FoGNet's corrections to a gyro's turns.
#[derive(Debug, Clone)]
pub struct FogCorrector {
    sums: SecondSums,
    minute: Minute,
    /// The estimate that is used from the end of this second on.
    next: Option<FogEstimate>,
    estimate: Option<FogEstimate>,
    /// The remainders of the divisions: of the linear part, of the spread part.
    linear_rest: i128,
    spread_rest: i64,
}

impl FogCorrector {
    pub const START: Self = Self {
        sums: SecondSums::ZERO,
        minute: Minute::EMPTY,
        next: None,
        estimate: None,
        linear_rest: 0,
        spread_rest: 0,
    };

    pub fn correct(&mut self, frame: &FogFrame, network: &mut (impl MinuteNetwork + ?Sized)) -> FogOutput {
        let correction = self.correction_of(frame.turn);
        let mut output = FogOutput {
            turn: Angle(frame.turn.0.saturating_sub(correction.0)),
            correction,
            corrected: self.estimate.is_some(),
            is_window: false,
            broken: false,
            implausible: false,
        };
        match self.sums.add(frame) {
            Ok(None) => {}
            Ok(Some(second)) => {
                self.minute.add(second);
                let newest = self.minute.window().map(|window| network.estimate(&window));
                let due = core::mem::replace(&mut self.next, newest);
                let Angle(max) = MAX_CORRECTION;
                self.estimate = due.filter(|estimate| (-max..=max).contains(&estimate.correction.0));
                output.is_window = true;
                output.implausible = self.estimate != due;
            }
            Err(Incomplete) => {
                // Neither a window nor an estimate may span a gap.
                let (linear_rest, spread_rest) = (self.linear_rest, self.spread_rest);
                *self = Self { linear_rest, spread_rest, ..Self::START };
                output.broken = true;
            }
        }
        output
    }

    fn correction_of(&mut self, turn: Angle) -> Angle {
        let Some(FogEstimate { correction, linear, gain, .. }) = self.estimate else { return Angle::ZERO };
        let linear_part = self.linear_rest + i128::from(turn.0) * i128::from(gain);
        self.linear_rest = linear_part & ((1 << GAIN_FRACTION_BITS) - 1);
        // Smaller than the increment itself, because the gain is below 1.
        let linear_part = (linear_part >> GAIN_FRACTION_BITS) as i64;
        let spread = self.spread_rest + correction.0.saturating_sub(linear.0);
        self.spread_rest = spread.rem_euclid(WINDOW_FRAMES);
        Angle(linear_part + spread.div_euclid(WINDOW_FRAMES))
    }
}
