//! Spans are pieces of a drive for which the reference gives the angle turned. Over a second or more the noise of the
//! reference is small compared with the errors that are fitted.

use super::{SHORTEST_S, STRAIGHT_RAD, too_short};
use crate::board::Step;
use crate::drive::DT;
use crate::drive::error::DataError;
use gyronet::sample::RATE_HZ;
use gyronet::units::AngularRate;

const SPAN: usize = RATE_HZ as usize;

/// The turns and the error of one piece of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The true turn less that of the corrected yaw rate, rad.
    pub error: f64,
    /// The turns about x, y and z by the gyro, rad.
    pub turns: [f64; 3],
    pub seconds: f64,
}

/// The spans of whole seconds in which every sample has a reference yaw rate, of a drive in progress.
#[derive(Debug, Default)]
pub struct Spans {
    samples: usize,
    /// The error and the turns of the second in progress.
    error: Option<f64>,
    turns: [f64; 3],
    turned: [f64; 2],
    spans: Vec<Span>,
}

impl Spans {
    /// Adds a step of the board that has run the drive with this static bias.
    pub fn add(&mut self, step: &Step, bias: &[f64; 3]) {
        if !step.is_compared {
            return;
        }
        if self.samples == 0 {
            (self.error, self.turns) = (Some(0.0), [0.0; 3]);
        }
        let (reference, corrected) = (step.input.reference, step.complete.rad_per_sec());
        self.error = self.error.zip(reference).map(|(error, truth)| error + (truth - corrected) * DT);
        let rates = step.input.sample.angular_rate.map(AngularRate::rad_per_sec);
        for ((sum, rate), bias) in self.turns.iter_mut().zip(rates).zip(bias) {
            *sum += (rate - bias) * DT;
        }
        self.samples += 1;
        if self.samples == SPAN {
            let (turns, seconds) = (self.turns, SPAN as f64 * DT);
            let turn = if turns[2].abs() < STRAIGHT_RAD { 0.0 } else { turns[2] };
            self.turned[usize::from(turn < 0.0)] += turn.abs();
            self.spans.extend(self.error.map(|error| Span { error, turns, seconds }));
            self.samples = 0;
        }
    }

    /// The sums of the turns of all seconds to the left and to the right, rad, which noise does not add to.
    pub fn turned(&self) -> [f64; 2] {
        self.turned
    }

    pub fn finish(self, path: &str) -> Result<Vec<Span>, DataError> {
        let seconds = self.spans.iter().map(|span| span.seconds).sum::<f64>();
        if seconds < SHORTEST_S {
            return Err(too_short(path, seconds));
        }
        Ok(self.spans)
    }
}
