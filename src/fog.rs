//! Corrects the turns of a fibre-optic gyro, frame by frame: it subtracts the Earth's rate and the gyro's bias
//! (`earth_and_bias`). [`FogCorrector`] also subtracts FoGNet's estimate of the remaining error; it runs on
//! recordings.
//!
//! # FoGNet
//!
//! A window covers a minute, and a new one is due every second, so 60 windows cover each second. A window's estimate
//! is used in the second after next, in which the caller runs the network ([`FogOutput::due`],
//! [`FogCorrector::deliver`]).
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
use crate::model::fognet::{FogEstimate, GAIN_FRACTION_BITS};
use crate::model::seconds::{FRAMES, FogFrame, Incomplete, NewSecond, STEPS, SecondSums};
use crate::units::Angle;

/// A window's correction is spread over this many frames.
const WINDOW_FRAMES: i64 = STEPS as i64 * FRAMES as i64;

#[derive(Debug, Clone, Copy)]
pub struct FogConfig {
    pub errors: FogErrors,
    pub latitude: Option<Latitude>,
    pub tilt: Tilt,
    /// Vibration left in a second's mean rate, 1 sigma, rad/s, standing and moving: no turn, its sum is zero.
    pub shake: [f32; 2],
    /// The caller's clock is a crystal's, against which that of the gyro is measured.
    pub clock_is_exact: bool,
    pub max_correction: Angle,
}

impl FogConfig {
    /// A level DSP-1760 on the simulated car of the training drives. FoGNet's limit, 0.02 rad a minute, is four times
    /// the Earth's share, and leaves room for 0.1 % of scale error over two full turns.
    pub const DEFAULT: Self = Self {
        errors: FogErrors::DSP1760,
        latitude: None,
        tilt: Tilt::NONE,
        shake: [6e-5, 1.56e-4],
        clock_is_exact: false,
        max_correction: Angle((0.02 * Angle::PER_RAD as f64) as i64),
    };
}

/// The reason why a window's estimate was rejected: its correction is too large.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImplausibleTurn {
    pub correction: Angle,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FogOutput {
    /// The frame's turn less the correction; `None` where the gyro has a gap.
    pub turn: Option<Angle>,
    pub correction: Angle,
    pub corrected: bool,
    /// A second is over: if it ends a window, [`FogCorrector::deliver`] its estimate within the next one.
    pub due: Option<NewSecond>,
    pub broken: Option<Incomplete>,
    pub implausible: Option<ImplausibleTurn>,
    pub late: bool,
}

/// Applies FoGNet's corrections to a gyro's turns, and collects the seconds of windows that the caller keeps.
#[derive(Debug, Clone)]
pub struct FogCorrector {
    config: FogConfig,
    sums: SecondSums,
    next: u32,
    is_first: bool,
    out: Option<(u32, Option<FogEstimate>)>,
    estimate: Option<FogEstimate>,
    /// The remainders of the divisions: of the linear part, of the spread part.
    linear_rest: i128,
    spread_rest: i64,
}

impl FogCorrector {
    pub const fn new(config: FogConfig) -> Self {
        Self {
            config,
            sums: SecondSums::ZERO,
            next: 0,
            is_first: true,
            out: None,
            estimate: None,
            linear_rest: 0,
            spread_rest: 0,
        }
    }

    #[inline(never)]
    pub fn correct(&mut self, frame: &FogFrame) -> FogOutput {
        let correction = frame.turn.map_or(Angle::ZERO, |turn| self.correction_of(turn));
        let mut output = FogOutput {
            turn: frame.turn.map(|turn| Angle(turn.0.saturating_sub(correction.0))),
            correction,
            corrected: frame.turn.is_some() && self.estimate.is_some(),
            due: None,
            broken: None,
            implausible: None,
            late: false,
        };
        match self.sums.add(frame) {
            Ok(None) => {}
            Ok(Some(second)) => {
                (output.implausible, output.late) = self.use_estimate();
                output.due = Some(NewSecond { number: self.next, is_first: self.is_first, second });
                self.out = Some((self.next, None));
                self.next = self.next.wrapping_add(1);
                self.is_first = false;
            }
            Err(incomplete) => {
                output.broken = Some(incomplete);
                self.break_window();
            }
        }
        output
    }

    /// Accepts the estimate of a window from [`FogOutput::due`], for the next second; returns false if it is late.
    pub fn deliver(&mut self, number: u32, estimate: FogEstimate) -> bool {
        match &mut self.out {
            Some((due, slot @ None)) if *due == number => {
                *slot = Some(estimate);
                true
            }
            _ => false,
        }
    }

    /// Drops the window and its estimate: neither may span a gap.
    pub fn break_window(&mut self) {
        self.sums = SecondSums::ZERO;
        self.is_first = true;
        self.out = None;
        self.estimate = None;
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

    fn use_estimate(&mut self) -> (Option<ImplausibleTurn>, bool) {
        let Some((_, estimate)) = self.out.take() else { return (None, false) };
        let max = self.config.max_correction.0;
        let implausible = estimate
            .filter(|estimate| !(-max..=max).contains(&estimate.correction.0))
            .map(|estimate| ImplausibleTurn { correction: estimate.correction });
        self.estimate = estimate.filter(|_| implausible.is_none());
        (implausible, estimate.is_none())
    }
}
