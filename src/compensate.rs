//! Computes corrected rates from the network's estimates.
//!
//! A sample's best estimate is the mean of those of all windows that cover it ([`Stride`]), complete only some samples
//! later. So two rates are sent for every sample:
//!
//! - the **live** rate at once, for control: the gyro less bias, level and gain, since no window covers the sample
//!   yet.
//! - the **delayed** rate [`CompensateConfig::lag`] samples later, for a receiver that integrates it to a heading.
//!
//! A revision of a delayed rate by a later window is carried into the rates that follow, a bounded part in each, so
//! that their sum reaches the sum of the best estimates. With c_k(t) the estimate for sample k as known at sample t,
//! and L the lag: `rate(t) = gyro(t-L) - c_{t-L}(t) - carried part of sum over k < t-L of (c_k(t) - c_k(t-1))`. The
//! live rate carries no revision, which mostly concerns the noise of past samples. Both carry the angle that
//! standstill has held at zero in the second before it was seen to end. The lag counts samples: a gap delays earlier
//! ones and drops none.
//!
//! A window of 0.1 s cannot observe a constant error, and one that a model has learnt is wrong on another vehicle. The
//! slow mean of the corrections is therefore subtracted from them: standstill finds the bias, gravity the level, and a
//! course or `calibrate` the gain. A linear part's share stays: it answers no constant input
//! ([`crate::model::BlobError::Constant`]), and its slow mean would be an error on a vehicle that shakes.
//!
//! | when | live | delayed |
//! |---|---|---|
//! | the first window is not full yet | gyro less bias | no rate during the lag, then gyro less bias |
//! | after a gap, clipping, a late or implausible estimate | gyro less bias | the best estimate of each sample, gyro less bias where it has none |
//! | clipped sample | gyro less bias, marked; nothing is carried into it | the same |
//! | wheels prove that the vehicle stands | zero | zero |

mod carried;
mod slow_mean;
mod stride;

pub use stride::{DELAY, Lag, OutOfRange, Stride};

use crate::model::Estimate;
use crate::model::window::WINDOW;
use crate::sample::{RATE_HZ, Validity};
use crate::units::AngularRate;
use carried::Carried;
use slow_mean::SlowMean;

/// Largest mean correction of a window that is accepted: vibration makes single ones large, not their mean.
pub const MAX_MEAN: AngularRate = AngularRate::from_deg_per_sec(6.0);
/// Largest single correction of a window that is accepted, which a utility vehicle's shake reaches.
const MAX_SINGLE: AngularRate = AngularRate(10 * MAX_MEAN.0);

/// Configures how estimates of the gyro's error become corrected rates.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CompensateConfig {
    pub stride: Stride,
    pub lag: Lag,
    /// Largest part of the revisions that one rate carries; no setting of a board.
    #[serde(skip, default = "max_revision")]
    pub max_revision: AngularRate,
    /// True if the corrections are subtracted. Otherwise the rate has the expected error of the gyro less bias.
    pub model: bool,
}

impl CompensateConfig {
    /// A window every five samples, with both estimates of a sample averaged; a lag of 70 ms, the shortest that does
    /// not increase the error on the validation drive (tools/MEASUREMENTS.md); 1 deg/s of revisions in one rate.
    pub const DEFAULT: Self = Self {
        stride: Stride::HALF,
        lag: match Lag::new(7) {
            Some(lag) => lag,
            None => Lag::MAX,
        },
        max_revision: max_revision(),
        model: true,
    };
}

const fn max_revision() -> AngularRate {
    AngularRate::from_deg_per_sec(1.0)
}

/// Revisions that need more samples than this are reported: 0.25 deg with the default bound.
const LONG: u64 = 25;

/// The number of samples kept: the newest one, and those before it that a window can still change.
const KEPT: usize = Lag::MAX.samples() + 1;

#[derive(Debug, Clone, Copy)]
struct Entry {
    tick: u32,
    /// Gyro less static bias, about x, y and z.
    rates: [AngularRate; 3],
    validity: Validity,
    /// The delayed rate was sent as zero, whatever the estimate.
    held: bool,
    sum: i64,
    count: i32,
    /// The estimate; 0 while `count` is 0.
    estimate: i32,
}

impl Entry {
    fn rate(&self) -> AngularRate {
        let [.., rate] = self.rates;
        rate
    }

    fn send(
        &self,
        remaining: Remaining,
        carried: &mut Carried,
        stands: bool,
        most: AngularRate,
    ) -> Compensated {
        let gyro = i64::from(self.rate().0);
        let (rate, withheld) =
            carried.send(gyro - self.taken(remaining), self.validity.is_good(), stands, most);
        let [roll, pitch, _] = self.rates;
        Compensated {
            tick: self.tick,
            rate,
            correction: code(gyro - i64::from(rate.0)),
            covered: self.count > 0,
            roll_and_pitch: [roll, pitch],
            estimate: AngularRate(self.estimate),
            withheld,
            validity: self.validity,
        }
    }

    /// Returns what is subtracted from the yaw rate: the estimate, the bias, and the gain's share of the rest.
    fn taken(&self, Remaining { bias, gain }: Remaining) -> i64 {
        let taken = i64::from(self.estimate) + i64::from(bias.0);
        let rest = i64::from(self.rate().0) - taken;
        if gain == 0.0 { taken } else { taken + (gain * rest as f32) as i64 }
    }
}

/// The gyro's error beyond its static bias and the network's estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Remaining {
    /// At any rate.
    pub bias: AngularRate,
    /// Share of the rate that is read too much.
    pub gain: f32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Compensated {
    pub tick: u32,
    pub rate: AngularRate,
    /// The correction that was subtracted from the gyro less its static bias.
    pub correction: AngularRate,
    pub covered: bool,
    /// The gyro's rates about x and y, less static bias.
    pub roll_and_pitch: [AngularRate; 2],
    pub estimate: AngularRate,
    /// The gyro's yaw rate less the bias, where standstill has set the sent rate to zero.
    pub withheld: Option<AngularRate>,
    pub validity: Validity,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Complete {
    pub tick: u32,
    /// Gyro less static bias.
    pub rate: AngularRate,
    pub correction: AngularRate,
    /// The sample is good: a window has covered it, and the part was not saturated.
    pub good: bool,
    pub valid: bool,
}

impl Complete {
    pub fn left(&self) -> Option<AngularRate> {
        self.valid_left().filter(|_| self.good)
    }

    /// Returns the rate less the correction, also where no window has covered the sample.
    pub fn valid_left(&self) -> Option<AngularRate> {
        self.valid.then_some(AngularRate(self.rate.0.saturating_sub(self.correction.0)))
    }
}

/// The reason why a window's estimate was rejected: its corrections are too large.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Implausible {
    pub mean: AngularRate,
    pub largest: AngularRate,
}

/// Holds the estimates of the samples that a window can still change, and the revisions still to be carried.
#[derive(Debug, Clone)]
pub struct Compensator {
    config: CompensateConfig,
    kept: [Option<Entry>; KEPT],
    next: usize,
    slow_mean: SlowMean,
    /// What the live rates (no window revises them) and the delayed rates still have to carry.
    live: Carried,
    delayed: Carried,
}

impl Compensator {
    pub const fn new(config: CompensateConfig) -> Self {
        Self {
            config,
            kept: [None; KEPT],
            next: 0,
            slow_mean: SlowMean::NONE,
            live: Carried::NONE,
            delayed: Carried::NONE,
        }
    }

    /// Revises the samples of the window that ended [`Stride::delay`] samples before the next one, all or none.
    pub fn revise(&mut self, estimate: &Estimate) -> Result<(), Implausible> {
        let CompensateConfig { stride, lag, model, .. } = self.config;
        let Estimate { corrections, linear_sum, .. } = if model { estimate } else { &Estimate::NONE };
        let sum: i64 = corrections.iter().map(|correction| i64::from(correction.0)).sum();
        let average = AngularRate((sum / WINDOW as i64) as i32);
        let largest = corrections.iter().max_by_key(|c| c.0.unsigned_abs()).copied().unwrap_or_default();
        if average.0.unsigned_abs() > MAX_MEAN.0.unsigned_abs()
            || largest.0.unsigned_abs() > MAX_SINGLE.0.unsigned_abs()
        {
            return Err(Implausible { mean: average, largest });
        }
        // Ages of the window's samples, which the corrections follow backwards.
        let newest = stride.delay() as usize - 1;
        self.slow_mean.observe((sum - linear_sum) / WINDOW as i64, stride.samples());
        let constant = self.slow_mean.get();
        for (age, correction) in (newest..newest + WINDOW).zip(corrections.iter().rev()) {
            let Some(entry) = self.kept.get_mut(place(self.next, age)).and_then(Option::as_mut) else {
                continue;
            };
            entry.sum += i64::from(correction.0) - constant;
            entry.count += 1;
            let estimate = mean(entry.sum, entry.count);
            let revision = estimate - i64::from(entry.estimate);
            entry.estimate = estimate as i32;
            if age >= lag.samples() {
                self.delayed.revise(revision, entry.held);
            }
        }
        Ok(())
    }

    /// Adds a sample: its gyro rates less static bias.
    pub fn add(&mut self, tick: u32, rates: [AngularRate; 3], validity: Validity) {
        let entry = Entry { tick, rates, validity, held: false, sum: 0, count: 0, estimate: 0 };
        if let Some(oldest) = self.kept.get_mut(self.next) {
            *oldest = Some(entry);
        }
        self.next = (self.next + 1) % KEPT;
    }

    /// Marks this many of the newest samples as [`Validity::Stuck`], because a later one has shown it.
    pub fn distrust(&mut self, samples: usize) {
        for age in 0..samples.min(KEPT) {
            if let Some(entry) = self.at_mut(age).filter(|entry| entry.validity.is_good()) {
                entry.validity = Validity::Stuck;
            }
        }
    }

    fn at(&self, age: usize) -> Option<&Entry> {
        self.kept.get(place(self.next, age))?.as_ref()
    }

    fn at_mut(&mut self, age: usize) -> Option<&mut Entry> {
        self.kept.get_mut(place(self.next, age))?.as_mut()
    }

    /// Returns the rate of the newest sample, less what remains; zero while the vehicle stands. Call it once for each sample.
    pub fn live(&mut self, remaining: Remaining, stands: bool) -> Option<Compensated> {
        let entry = self.kept.get(place(self.next, 0))?.as_ref()?;
        Some(entry.send(remaining, &mut self.live, stands, self.config.max_revision))
    }

    /// Returns the rate of the sample [`CompensateConfig::lag`] before the newest one, once per sample; `None` before
    /// there is one. `stands`: the vehicle has stood since before that sample, whose rate is then zero.
    pub fn delayed(&mut self, remaining: Remaining, stands: bool) -> Option<Compensated> {
        let entry = self.kept.get_mut(place(self.next, self.config.lag.samples()))?.as_mut()?;
        entry.held = stands && entry.validity.is_good();
        Some(entry.send(remaining, &mut self.delayed, stands, self.config.max_revision))
    }

    /// Returns the newest sample that no window changes any more; each sample is returned once.
    pub fn complete(&self) -> Option<Complete> {
        let entry = self.at(self.config.stride.complete_after())?;
        Some(Complete {
            tick: entry.tick,
            rate: entry.rate(),
            correction: AngularRate(entry.estimate),
            good: entry.count > 0 && entry.validity.is_good(),
            valid: entry.validity.is_good(),
        })
    }

    pub fn end_standstill(&mut self) {
        self.live.end_standstill();
        self.delayed.end_standstill();
    }

    /// Returns whether more waits to be carried than a window revises, as after a turn on standing wheels.
    pub fn revisions_exceed_limit(&self) -> bool {
        let much = LONG * u64::from(self.config.max_revision.0.unsigned_abs());
        self.delayed.waiting.unsigned_abs() > much
    }

    /// Returns how much of the revisions the delayed rates carry in the next second, rad.
    pub fn carried_in_a_second(&self) -> f32 {
        let most = i64::from(RATE_HZ) * i64::from(self.config.max_revision.0).max(0);
        let carried = self.delayed.waiting.unsigned_abs().min(most.unsigned_abs());
        carried as f32 / (AngularRate::PER_RAD_PER_SEC * RATE_HZ as f32)
    }

    /// Returns what the sum of the delayed rates lacks, codes x samples: revisions, and samples not sent yet.
    pub fn pending(&self, remaining: Remaining) -> i64 {
        let waiting = (0..self.config.lag.samples()).flat_map(|age| self.at(age));
        let waiting = waiting.filter(|entry| entry.validity.is_good());
        let best = |entry: &Entry| i64::from(entry.rate().0) - entry.taken(remaining);
        waiting.map(best).sum::<i64>() - self.delayed.waiting
    }
}

/// Returns the place of the sample this many before the newest one, where `next` is that of the next sample.
const fn place(next: usize, age: usize) -> usize {
    let place = next + KEPT - 1 - age;
    if place >= KEPT { place - KEPT } else { place }
}

/// Returns the mean of so many values, rounded towards zero; 0 of none.
fn mean(sum: i64, count: i32) -> i64 {
    match i32::try_from(sum) {
        // The processor divides 32 bits alone in hardware.
        Ok(sum) => sum.checked_div(count).unwrap_or(0).into(),
        Err(_) => sum.checked_div(count.into()).unwrap_or(0),
    }
}

fn code(rate: i64) -> AngularRate {
    AngularRate(rate.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
}
