//! From the network's estimates to the rate that goes out.
//!
//! A window runs every [`HOP`] samples, so each sample is covered by two windows; its best
//! estimate is the mean of those seen so far. The newest output of a window is its worst (it
//! knows only the past), so the estimate that a sample goes out with is revised later. The
//! revision is not lost: it is carried into the rates that follow, so that a receiver who sums
//! the rates arrives at the sum of the best estimates. One frame carries at most a bounded part
//! of it, so that no frame jumps.
//!
//! Written out, with c_k(t) the estimate for sample k as known at sample t:
//! `rate(t) = gyro(t) - c_t(t) - carried part of sum over k <= t of (c_k(t) - c_k(t-1))`.

use crate::model::Corrections;
use crate::units::AngularRate;
use crate::window::WINDOW;
use serde::{Deserialize, Serialize};

/// Samples between two windows.
pub const HOP: u32 = 5;
/// An estimate is used this many samples after its window's newest one, whatever the time the
/// network took: the board's frames then do not depend on its speed.
pub const DELAY: u32 = 2;

/// Bounds of the correction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CompensateConfig {
    /// A window whose mean correction is larger is not believed (rad/s code). Vibration makes
    /// single corrections large; their mean is bias-like and small.
    pub max_mean: AngularRate,
    /// Largest part of the revisions that one frame carries.
    pub max_carry: AngularRate,
}

impl CompensateConfig {
    /// 3 deg/s for a window's mean, 1 deg/s of carry a frame.
    pub const DEFAULT: Self = Self { max_mean: AngularRate(7_027_624), max_carry: AngularRate(2_342_541) };
}

/// Samples that a window delivered now can still reach.
const REACH: usize = WINDOW + DELAY as usize - 1;

/// A sample's estimate is settled when this many more samples have come.
pub const SETTLED_AFTER: u32 = REACH as u32;

/// The best estimate of one sample so far.
#[derive(Debug, Clone, Copy, Default)]
struct Best {
    sum: i64,
    count: i32,
    value: i32,
}

/// Estimates of the samples that a window can still reach, and what is left to carry.
#[derive(Debug, Clone)]
pub struct Compensator {
    config: CompensateConfig,
    /// The newest sample last; the window that ended [`DELAY`] before the next sample is first.
    best: [Best; REACH],
    /// Mean of the last window: what a sample goes out with before a window has covered it.
    prior: i32,
    /// Revisions not yet emitted.
    carry: i64,
}

/// A window's estimate was not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Implausible {
    /// The mean correction of the window.
    pub mean: AngularRate,
}

impl Compensator {
    /// No estimate yet.
    #[must_use]
    pub fn new(config: CompensateConfig) -> Self {
        Self { config, best: [Best::default(); REACH], prior: 0, carry: 0 }
    }

    /// Takes in a sample and returns the correction to subtract from its gyro rate, and the best
    /// estimate for the sample [`SETTLED_AFTER`] before it, which no window reaches any more.
    ///
    /// `good`: whether the rate goes out as good. What is owed is not paid in a frame that a
    /// receiver drops.
    pub fn correction(&mut self, good: bool) -> (AngularRate, Option<AngularRate>) {
        let [oldest, ..] = self.best;
        self.best.rotate_left(1);
        let newest = Best { sum: 0, count: 0, value: self.prior };
        self.best[REACH - 1] = newest;
        let settled = (oldest.count > 0).then_some(AngularRate(oldest.value));
        // A negative bound would be none.
        let bound = if good { i64::from(self.config.max_carry.0).max(0) } else { 0 };
        let carried = self.carry.clamp(-bound, bound);
        self.carry -= carried;
        (AngularRate(newest.value.saturating_add(carried as i32)), settled)
    }

    /// Revises the samples of the window that ended [`DELAY`] samples before the next one.
    ///
    /// # Errors
    /// [`Implausible`]: nothing was revised, and the prior falls back to zero.
    pub fn revise(&mut self, corrections: &Corrections) -> Result<(), Implausible> {
        let sum: i64 = corrections.iter().map(|c| i64::from(c.0)).sum();
        let mean = (sum / WINDOW as i64) as i32;
        if mean.unsigned_abs() > self.config.max_mean.0.unsigned_abs() {
            self.prior = 0;
            return Err(Implausible { mean: AngularRate(mean) });
        }
        for (best, correction) in self.best.iter_mut().zip(corrections) {
            best.sum += i64::from(correction.0);
            best.count += 1;
            let value = best.sum.checked_div(i64::from(best.count)).unwrap_or(0) as i32;
            self.carry += i64::from(value) - i64::from(best.value);
            best.value = value;
        }
        self.prior = mean;
        Ok(())
    }

    /// No estimate came: the last one is not held on to.
    pub fn forget(&mut self) {
        self.prior = 0;
    }

    /// After a gap no window may reach back across it; the carry stays owed.
    pub fn break_window(&mut self) {
        self.best = [Best::default(); REACH];
        self.prior = 0;
    }

    /// Revisions that are known but not yet emitted, in codes x samples.
    #[must_use]
    pub fn carry(&self) -> i64 {
        self.carry
    }
}
