//! The two errors of a model that was trained with another unit: a constant, and the mounting.
//!
//! The mean of the corrections shows the constant. The mounting check determines whether the mounting is that of
//! the unit that the model runs on.
//!
//! A linear part subtracts some of the roll and pitch rates from the yaw rate: the mounting of the unit that it was
//! trained with. On another unit that adds an error. While a vehicle drives, its yaw rate changes slowly, and its
//! roll and pitch rates fast: over a few tenths of a second, the part of the yaw rate that changes with them is the
//! unit's own coupling. So changes of the yaw rate are fitted by those of the mounting's correction, by least
//! squares. The factor is 1 where they agree at all frequencies; where it is below one half, the correction does more
//! harm than good.
//!
//! The factor shows whether the unit is the model's, not how large its coupling is at the frequencies of a turn:
//! `gyronet calibrate` measures that.

use crate::sqrt::sqrt;
use crate::units::AngularRate;

/// Samples of a mean: 0.2 s.
const BLOCK: u32 = 20;
/// Changes that are needed before the factor counts: 12 s of driving.
const FEWEST: f32 = 60.0;
/// Changes after which old ones are forgotten: ten minutes of driving.
const MOST: f32 = 3_000.0;
/// The correction is useful from this factor on.
const HALF: f32 = 0.5;
/// The factor must be this many of its standard deviations away from [`HALF`].
const SIGMAS: f32 = 2.0;
/// Neighbouring changes share two of their three means, so they count as half their number.
const INDEPENDENT: f32 = 0.5;

/// The means of yaw rate and correction over a block, rad/s.
type Means = [f32; 2];

/// Fits the changes of the yaw rate by those of the correction.
#[derive(Debug, Clone, Copy)]
pub(super) struct MountingCheck {
    /// Sums of the current block, codes, and its number of samples.
    sums: [i64; 2],
    samples: u32,
    /// The two blocks before, the older one first, if the vehicle drove through them.
    before: [Option<Means>; 2],
    /// Number of changes, and the sums of their products: correction squared, with the yaw rate, yaw rate squared.
    count: f32,
    products: [f32; 3],
    /// `None` before driving has shown it.
    is_own: Option<bool>,
}

impl MountingCheck {
    /// The mounting counts as the unit's own until it is shown not to be.
    pub(super) const START: Self =
        Self { sums: [0; 2], samples: 0, before: [None; 2], count: 0.0, products: [0.0; 3], is_own: None };

    /// Returns whether the mounting is the unit's own; `None` before driving has shown it.
    pub(super) fn is_own(&self) -> Option<bool> {
        self.is_own
    }

    /// Adds a sample's yaw rate and the correction of the mounting. Returns whether the mounting has just been found
    /// to be another unit's.
    pub(super) fn observe(&mut self, yaw_rate: AngularRate, correction: AngularRate) -> bool {
        self.sums[0] += i64::from(yaw_rate.0);
        self.sums[1] += i64::from(correction.0);
        self.samples += 1;
        if self.samples < BLOCK {
            return false;
        }
        let per_sum = 1.0 / (AngularRate::PER_RAD_PER_SEC * BLOCK as f32);
        let newest = core::mem::take(&mut self.sums).map(|sum| sum as f32 * per_sum);
        self.samples = 0;
        let [oldest, middle] = self.before;
        self.before = [middle, Some(newest)];
        let (Some(oldest), Some(middle)) = (oldest, middle) else { return false };
        let [yaw_rate, correction] = core::array::from_fn(|k| middle[k] - 0.5 * (oldest[k] + newest[k]));
        let keep = if self.count < MOST { 1.0 } else { 1.0 - 1.0 / MOST };
        let added = [correction * correction, correction * yaw_rate, yaw_rate * yaw_rate];
        for (sum, product) in self.products.iter_mut().zip(added) {
            *sum = *sum * keep + product;
        }
        self.count = self.count * keep + 1.0;
        self.judge()
    }

    /// Drops the current block, because the vehicle does not drive, or samples are missing.
    pub(super) fn interrupt(&mut self) {
        (self.sums, self.samples, self.before) = ([0; 2], 0, [None; 2]);
    }

    fn judge(&mut self) -> bool {
        let [squared, with_yaw, yaw_squared] = self.products;
        if self.count < FEWEST || squared <= 0.0 {
            return false;
        }
        let factor = with_yaw / squared;
        let unexplained = (yaw_squared - factor * with_yaw).max(0.0);
        let sigma = sqrt(unexplained / squared / (INDEPENDENT * self.count));
        let before = self.is_own;
        if factor + SIGMAS * sigma < HALF {
            self.is_own = Some(false);
        } else if factor - SIGMAS * sigma > HALF {
            self.is_own = Some(true);
        }
        self.is_own == Some(false) && before != Some(false)
    }
}

/// The number of samples that the mean covers.
const MEMORY: i64 = 1_280;
/// Fraction bits of the mean.
const Q: u32 = 16;

/// The mean of a value: of all so far, and later of about the last [`MEMORY`] samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlowMean {
    mean: i64,
    count: i64,
}

impl SlowMean {
    /// The mean before the first value is zero.
    pub(super) const NONE: Self = Self { mean: 0, count: 0 };

    /// Adds a value, within 2^32; values arrive every `stride` samples.
    pub(super) fn observe(&mut self, value: i64, stride: u32) {
        let most = MEMORY.checked_div(stride.into()).unwrap_or(MEMORY);
        self.count = (self.count + 1).min(most);
        let beyond = (value << Q) - self.mean;
        self.mean += beyond.checked_div(self.count).unwrap_or(0);
    }

    pub(super) fn get(self) -> i64 {
        self.mean >> Q
    }
}
