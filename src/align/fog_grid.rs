//! Puts the increments of a fibre-optic gyro on a grid of the board's clock, at its multiples of 10 ms.
//!
//! A step is emitted as soon as the increments have passed it, and at the latest [`MAX_DELAY_US`] after its time.
//! Later increments are not used.

use super::clock::{ClockError, PartClock};
use super::increments::{Increments, Turn};
use crate::sample::{FogSample, PERIOD_US};
use crate::units::Micros;

pub const MAX_DELAY_US: u64 = 10_000;
/// The time between two calls after which the grid restarts, at the next step: one second.
pub const MAX_SILENCE_US: u64 = 1_000_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The step's time by the board's clock, a multiple of [`PERIOD_US`].
    pub time: Micros,
    pub turn: Turn,
}

#[derive(Debug, Clone)]
pub struct FogGrid {
    clock: PartClock,
    increments: Increments,
    next: Option<u64>,
}

impl FogGrid {
    /// The state before the first sample. Where one is `expected`, steps are due from time 0 on, and empty until it comes.
    pub const fn new(expected: bool) -> Self {
        let next = if expected { Some(0) } else { None };
        Self { clock: PartClock::START, increments: Increments::EMPTY, next }
    }

    pub fn add(&mut self, now: Micros, sample: FogSample) -> Result<(), ClockError> {
        let board = self.clock.translate(sample.time, now)?;
        if board.jumped {
            self.increments.disconnect();
        }
        self.next.get_or_insert(board.time.0.next_multiple_of(PERIOD_US));
        self.increments.add(board.time, &sample);
        Ok(())
    }

    /// Returns whether there is a next step, which time alone makes due.
    pub fn is_running(&self) -> bool {
        self.next.is_some()
    }

    /// Returns whether the next step is complete or due, or so old that the grid restarts.
    pub fn is_due(&self, now: Micros) -> bool {
        self.next.is_some_and(|next| {
            self.increments.has_reached(Micros(next)) || now.0.saturating_sub(next) >= MAX_DELAY_US
        })
    }

    /// Returns the next step, if complete or due. Call it until `None` after every sample, and every few ms.
    #[inline(never)]
    pub fn next_step(&mut self, now: Micros) -> Option<Step> {
        let next = self.next?;
        let waited = now.0.saturating_sub(next);
        if waited > MAX_SILENCE_US {
            // The caller has not asked for a step for a second, so these steps are useless by now.
            self.next = Some(now.0.next_multiple_of(PERIOD_US));
            return None;
        }
        if !self.is_due(now) {
            return None;
        }
        let time = Micros(next);
        self.next = Some(next + PERIOD_US);
        Some(Step { time, turn: self.increments.take(time) })
    }
}
