//! Brings the inertial sensor's samples, 50 to 1000 a second, to the steps of a 100 Hz grid by their time stamps.
//!
//! A sample stands for the time since the one before it, and a step for the 10 ms before its end. A step's value is the
//! mean of the samples that cover it, each weighted by the time that it covers, and the division's remainder is carried.
//! So the sum over the steps is the integral of the samples by their stamps (at about 100 Hz by stamps on the grid, where
//! they are near it), at any rate, constant or not:
//!
//! | samples a second | a step is | filter, delay |
//! |---|---|---|
//! | 100, within [`SNAP_US`] of the grid | its sample, bit for bit | none |
//! | more | the mean over 10 ms | a boxcar: first null at 100 Hz, -3 dB at 44 Hz; half a step less half a period, at most 4.5 ms |
//! | fewer | the newest sample, or parts of two | hold: each period gives its steps together when its sample arrives |
//! | below 45 or above 1111 ([`PERIODS_US`]) | none: [`AlignError::Rate`] | |
//!
//! Stamps may jitter by a fifth of the period. The first sample sets the grid. Where samples are missing (1.6 usual
//! periods pass, and 2 ms more than one), the time beyond a usual period is not covered, and a step that is covered by
//! less than half is left out. A duplicate and a
//! sample older than the last one are errors and change nothing. A jump of more than a second either way (a part that
//! restarted, a cable that was reconnected) is an error too, but the grid restarts there: no wait is unbounded.
//!
//! [`clock_ratio`] measures how fast the sensor's clock runs against the board's. A fibre-optic gyro has a clock and
//! increments of its own: [`fog_grid`] converts its time stamps to the board's clock ([`clock`]) and sums its
//! increments over the steps of a grid ([`increments`]).

pub mod clock;
pub mod clock_ratio;
pub mod fog_grid;
pub mod increments;

use crate::sample::{Frame, ImuSample, PERIOD_US, Validity};
use crate::units::{AngularRate, Micros, SpecificForce};
use core::ops::RangeInclusive;

/// Sample periods that are used, microseconds: 50 to 1000 Hz, with a tenth to spare for oscillators.
pub const PERIODS_US: RangeInclusive<u64> = 900..=22_000;
/// A sample of a sensor at about 100 Hz this near a step's end counts as taken at it, us: jitter changes nothing.
pub const SNAP_US: u64 = 2_000;
/// The longest run of missing steps that keeps the grid: one second.
pub const MAX_GAP: u32 = 100;

const SNAPPED_US: RangeInclusive<u64> = 9_000..=11_000;
const STEP: i64 = PERIOD_US as i64;
/// Time ends here, so that sums of times do not overflow.
const END: u64 = 1 << 62;
const PERIODS: usize = 8;

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum AlignError {
    #[error("duplicate sample at {} us", .at.0)]
    Duplicate { at: Micros },
    #[error("time goes backwards, from {} to {} us", .last.0, .at.0)]
    Backwards { last: Micros, at: Micros },
    /// The sample completes no step ([`crate::pipeline::Pipeline::correct`] alone).
    #[error("the sample at {} us completes no step of 10 ms", .at.0)]
    Open { at: Micros },
    #[error("a sample every {period_us} us: 50 to 1000 a second are used")]
    Rate { period_us: u64 },
    #[error("time jumps from {} to {} us, more than 1 s", .last.0, .at.0)]
    Jump { last: Micros, at: Micros },
}

/// The part of a sample's time that no step has taken yet.
#[derive(Debug, Clone, Copy)]
struct Piece {
    begin: i64,
    end: i64,
}

/// The readings summed over the covered part of the open step, in codes times microseconds: force, then rate.
#[derive(Debug, Clone, Copy)]
struct Sums {
    axes: [i64; 6],
    covered: i64,
    validity: Validity,
}

impl Sums {
    const NONE: Self = Self { axes: [0; 6], covered: 0, validity: Validity::Good };
}

#[derive(Debug, Clone)]
pub struct Aligner {
    /// The newest sample, and its end on the grid's time line.
    last: Option<(ImuSample, i64)>,
    piece: Option<Piece>,
    /// End and number of the open step.
    end: i64,
    tick: u32,
    missing: u32,
    sums: Sums,
    rest: [i64; 6],
    /// The newest periods, us, the place of the oldest, and their mean, or where samples are missing their median.
    periods: [u32; PERIODS],
    oldest: usize,
    usual: u32,
}

impl Aligner {
    pub const START: Self = Self {
        last: None,
        piece: None,
        end: 0,
        tick: 0,
        missing: 0,
        sums: Sums::NONE,
        rest: [0; 6],
        periods: [PERIOD_US as u32; PERIODS],
        oldest: 0,
        usual: PERIOD_US as u32,
    };

    /// Adds a sample; then call [`Aligner::next_frame`] until `None`. After [`AlignError::Jump`] the grid continues
    /// from that sample's stamp, at the next tick; after [`AlignError::Rate`] the steps up to it are missing.
    pub fn add(&mut self, sample: ImuSample) -> Result<(), AlignError> {
        let at = sample.time;
        let time = at.0.min(END) as i64;
        let Some((newest, begin)) = self.last else {
            self.last = Some((sample, time));
            self.end = time;
            self.piece = Some(Piece { begin: time - STEP, end: time });
            return Ok(());
        };
        let last = newest.time;
        if at == last {
            return Err(AlignError::Duplicate { at });
        }
        let elapsed = at.0.abs_diff(last.0);
        let longest = u64::from(MAX_GAP) * PERIOD_US + if at < last { 0 } else { PERIOD_US * 3 / 2 - 1 };
        if elapsed > longest {
            self.last = Some((sample, time));
            (self.end, self.piece, self.sums) = (time + STEP, None, Sums::NONE);
            return Err(AlignError::Jump { last, at });
        }
        if at < last {
            return Err(AlignError::Backwards { last, at });
        }
        // Steps that the caller has not fetched are dropped.
        while self.next_frame().is_some() {}
        let usual = u64::from(self.usual);
        let is_gap = elapsed >= (usual * 8 / 5).max(usual + SNAP_US);
        self.learn_period(elapsed as u32);
        let period_us = u64::from(self.usual);
        let end = self.snapped(time, period_us).max(begin);
        self.last = Some((sample, end));
        if !PERIODS_US.contains(&period_us) {
            self.omit_to(end);
            return Err(AlignError::Rate { period_us });
        }
        let begin = if is_gap { begin.max(end - usual as i64) } else { begin };
        self.piece = Some(Piece { begin, end });
        Ok(())
    }

    pub fn is_nearly_complete(&self) -> bool {
        self.last.is_none_or(|(_, end)| self.end - end < 2 * i64::from(self.usual))
    }

    #[inline]
    pub fn has_piece(&self) -> bool {
        self.piece.is_some()
    }

    pub fn next_frame(&mut self) -> Option<Frame> {
        self.piece?;
        let (sample, _) = self.last?;
        // As many turns as steps are missing, and one.
        loop {
            let piece = self.piece?;
            let covered = piece.end.min(self.end) - piece.begin;
            if covered > 0 {
                self.sum(&sample, covered);
            }
            if piece.end < self.end {
                self.piece = None;
                return None;
            }
            let rest = Piece { begin: piece.begin.max(self.end), end: piece.end };
            self.piece = Some(rest).filter(|rest| rest.begin < rest.end);
            // A sample that ends with the step keeps its own stamp.
            let time = if piece.end == self.end { sample.time } else { Micros(self.end as u64) };
            let sums = core::mem::replace(&mut self.sums, Sums::NONE);
            let (tick, missing) = (self.tick, self.missing);
            (self.tick, self.end) = (tick.wrapping_add(1), self.end + STEP);
            if sums.covered * 2 >= STEP {
                self.missing = 0;
                let sample = if covered == STEP { sample } else { self.mean(&sums, &sample) };
                return Some(Frame { tick, missing, sample: ImuSample { time, ..sample } });
            }
            self.missing = missing.saturating_add(1);
        }
    }

    /// Skips the steps that end by this time, and drops the samples of the open one.
    fn omit_to(&mut self, time: i64) {
        let steps = ((time - self.end).div_euclid(STEP) + 1).max(0);
        let number = u32::try_from(steps).unwrap_or(u32::MAX);
        (self.tick, self.missing) = (self.tick.wrapping_add(number), self.missing.saturating_add(number));
        (self.end, self.sums) = (self.end + steps * STEP, Sums::NONE);
    }

    fn sum(&mut self, sample: &ImuSample, covered: i64) {
        for (sum, axis) in self.sums.axes.iter_mut().zip(sample.codes()) {
            *sum += i64::from(axis) * covered;
        }
        self.sums.covered += covered;
        if self.sums.validity.is_good() {
            self.sums.validity = sample.validity;
        }
    }

    /// Returns the mean of the covered part, with the remainder of the one before.
    fn mean(&mut self, sums: &Sums, newest: &ImuSample) -> ImuSample {
        let mut means = [0; 6];
        for ((mean, rest), sum) in means.iter_mut().zip(&mut self.rest).zip(sums.axes) {
            let whole = (sum + *rest).checked_div_euclid(sums.covered).unwrap_or(0);
            *rest = sum + *rest - whole * sums.covered;
            // A mean of codes is a code, but for the last bit.
            *mean = whole.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
        }
        let [fx, fy, fz, wx, wy, wz] = means;
        ImuSample {
            specific_force: [fx, fy, fz].map(SpecificForce),
            angular_rate: [wx, wy, wz].map(AngularRate),
            validity: sums.validity,
            ..*newest
        }
    }

    fn learn_period(&mut self, period: u32) {
        let Some(oldest) = self.periods.get_mut(self.oldest) else { return };
        self.oldest = (self.oldest + 1) % PERIODS;
        if core::mem::replace(oldest, period) == period {
            return;
        }
        let up_to = |limit: u32| self.periods.iter().filter(|period| **period <= limit).count();
        let upper_half = self.periods.into_iter().filter(|period| up_to(*period) > PERIODS / 2);
        let median = upper_half.min().unwrap_or(period);
        // Jitter nearly cancels in a mean, which a gap would spoil.
        let is_whole = self.periods.iter().all(|period| *period < median.saturating_mul(2));
        self.usual = if is_whole { self.periods.iter().sum::<u32>() / PERIODS as u32 } else { median };
    }

    /// Returns the end of a step if the time is near it, else the time.
    fn snapped(&self, time: i64, period_us: u64) -> i64 {
        let near = if SNAPPED_US.contains(&period_us) { SNAP_US as i64 } else { 0 };
        let from_end = time - self.end;
        let after = match i32::try_from(from_end) {
            // The usual case: a Cortex-M4 divides 32 bits in hardware, and 64 bits in software.
            Ok(from_end) => from_end.rem_euclid(STEP as i32).into(),
            Err(_) => from_end.rem_euclid(STEP),
        };
        let to_next = STEP - after;
        if after <= near {
            time - after
        } else if to_next <= near {
            time + to_next
        } else {
            time
        }
    }
}
