//! The heading error of a yaw rate over 1 s, 60 s and a whole drive, against a reference yaw rate or a course.
//!
//! A reference yaw rate gives every figure. A course over ground (GNSS) is the direction of travel, not the heading:
//! latency, side slip and noise give it errors of 0.05 to 0.1 rad from one second to the next. So errors against a
//! course are medians over 10 s, which still scatter by 0.02 rad. A course cannot judge 1 s.
//!
//! The figures are computed sample by sample, and nothing older than a minute is kept but the medians of ten seconds
//! against a course: means and squares are sums. Only the median error in 10 s over the whole drive
//! ([`Errors::typical_10s`]) is counted in classes of 5 mrad.

use super::angle::wrap;
use crate::drive::DT;
use gyronet::sample::RATE_HZ;
use serde::Serialize;
use std::collections::VecDeque;

const SECOND: usize = RATE_HZ as usize;
/// Seconds over which the median of the error against a course is taken.
pub const BLOCK_S: usize = 10;
/// Fewest values of the course for a median.
const BLOCK_VALUES: usize = 3;
/// Samples of known course over whose median both headings are aligned: 20 s.
pub(super) const ALIGNED: usize = 20 * SECOND;
/// Largest [`Errors::typical_10s`] that a bias can explain, rad.
pub const PLAUSIBLE_10S_RAD: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    pub figures: HeadingError,
    /// The median absolute change of the error in 10 s, rad, to 5 mrad. It is large if rate and reference differ in
    /// sign or unit, or are not from the same drive.
    pub typical_10s: Option<f64>,
}

/// The figures of a heading error; `None` if the reference cannot give a figure, or the drive is too short for it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct HeadingError {
    /// Mean absolute error of the heading change over 1 s; a window starts every second.
    pub mean_1s_rad: Option<f64>,
    /// Mean absolute error of the heading change over 60 s.
    pub mean_60s_rad: Option<f64>,
    /// RMS of the error over the drive.
    pub rms_rad: Option<f64>,
    /// The absolute error at the end; a whole turn counts.
    pub final_rad: Option<f64>,
}

impl HeadingError {
    /// The figure by which methods are compared: the 1 s error, or the RMS over the drive if there is none.
    pub fn compared(&self) -> Option<f64> {
        self.mean_1s_rad.or(self.rms_rad)
    }

    pub fn mean(errors: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> Option<f64>| mean(errors.iter().filter_map(of));
        Self {
            mean_1s_rad: mean(|error| error.mean_1s_rad),
            mean_60s_rad: mean(|error| error.mean_60s_rad),
            rms_rad: mean(|error| error.rms_rad),
            final_rad: mean(|error| error.final_rad),
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    count: f64,
    sum: f64,
}

impl Mean {
    fn add(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.count += 1.0;
            self.sum += value;
        }
    }

    fn get(&self) -> Option<f64> {
        (self.count > 0.0).then_some(self.sum / self.count)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut mean = Mean::default();
    mean.add(values);
    mean.get()
}

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// A median of magnitudes in progress, by counting classes of 5 mrad up to 50 rad.
#[derive(Debug, Clone, Default)]
struct Typical {
    /// The counts of the classes up to the largest that was needed.
    classes: Vec<u64>,
    count: u64,
}

impl Typical {
    const CLASS: f64 = 0.005;
    const LAST: usize = 10_000;

    fn add(&mut self, value: f64) {
        // A value at the upper end of a class belongs to it.
        let class = ((value / Self::CLASS).ceil() as usize).min(Self::LAST);
        self.classes.resize(self.classes.len().max(class + 1), 0);
        self.classes[class] += 1;
        self.count += 1;
    }

    fn median(&self) -> Option<f64> {
        let mut below = 0;
        let class = self.classes.iter().position(|count| {
            below += count;
            below > self.count / 2
        })?;
        Some(class as f64 * Self::CLASS)
    }
}

/// The changes of an error over windows of different length, from one step to a later one; a step is `STEP_S` seconds.
#[derive(Debug, Clone, Default)]
struct Changes<const STEP_S: usize> {
    /// The errors of the last minute, rad; `None` while the reference is unknown.
    recent: VecDeque<Option<f64>>,
    second: Mean,
    minute: Mean,
    squares: Mean,
    typical: Typical,
}

impl<const STEP_S: usize> Changes<STEP_S> {
    fn add(&mut self, error: Option<f64>) {
        let change = |seconds: usize| {
            let earlier = self.recent.iter().rev().nth((seconds / STEP_S).checked_sub(1)?)?;
            Some((error? - (*earlier)?).abs())
        };
        let [second, typical, minute] = [1, 10, 60].map(change);
        self.second.add(second);
        typical.into_iter().for_each(|change| self.typical.add(change));
        self.minute.add(minute);
        self.squares.add(error.map(|error| error * error));
        self.recent.push_back(error);
        if self.recent.len() > 60 / STEP_S {
            self.recent.pop_front();
        }
    }

    fn errors(&self, last: f64) -> Errors {
        let figures = HeadingError {
            mean_1s_rad: self.second.get(),
            mean_60s_rad: self.minute.get(),
            rms_rad: self.squares.get().map(f64::sqrt),
            final_rad: Some(last.abs()),
        };
        Errors { figures, typical_10s: self.typical.median() }
    }
}

/// The heading error against a reference yaw rate, in progress.
#[derive(Debug, Clone)]
pub struct AgainstRate {
    angle: f64,
    samples: usize,
    changes: Changes<1>,
}

impl Default for AgainstRate {
    fn default() -> Self {
        let mut changes = Changes::default();
        changes.add(Some(0.0));
        Self { angle: 0.0, samples: 0, changes }
    }
}

impl AgainstRate {
    /// Adds a sample: the estimated and the true yaw rate, rad/s.
    pub fn add(&mut self, rate: f64, truth: f64) {
        self.angle += (rate - truth) * DT;
        self.samples += 1;
        if self.samples.is_multiple_of(SECOND) {
            self.changes.add(Some(self.angle));
        }
    }

    /// The errors so far; `None` for less than a second.
    pub fn errors(&self) -> Option<Errors> {
        (self.samples >= SECOND).then(|| self.changes.errors(self.angle))
    }
}

/// The integral of a yaw rate less the course, where the course is known. The difference is unwrapped instead of the
/// course, because the difference changes slowly even if the vehicle turns while the course is unknown.
#[derive(Debug, Clone, Copy, Default)]
pub struct OffCourse {
    yaw: f64,
    last: Option<f64>,
}

impl OffCourse {
    pub fn yaw(&self) -> f64 {
        self.yaw
    }

    /// Adds a sample; returns the difference if the course is known.
    pub fn add(&mut self, rate: f64, course: Option<f64>) -> Option<f64> {
        self.yaw += rate * DT;
        let off = self.yaw - course?;
        let near = self.last.unwrap_or(off);
        self.last = Some(near + wrap(off - near));
        self.last
    }
}

/// The median of each block of [`BLOCK_S`] seconds; `None` if too few values are known.
#[derive(Debug, Clone, Default)]
pub struct Blocks {
    known: Vec<f64>,
    samples: usize,
}

impl Blocks {
    /// Adds a sample; returns the median of the block that ends with it.
    pub fn add(&mut self, value: Option<f64>) -> Option<Option<f64>> {
        self.known.extend(value);
        self.samples += 1;
        if self.samples == BLOCK_S * SECOND { self.end() } else { None }
    }

    pub fn end(&mut self) -> Option<Option<f64>> {
        let Self { known, samples } = std::mem::take(self);
        (samples > 0).then(|| if known.len() < BLOCK_VALUES { None } else { median(known) })
    }
}

#[derive(Debug, Clone, Default)]
pub struct AgainstCourse {
    off: OffCourse,
    blocks: Blocks,
    samples: usize,
    /// The first and the last sample with a course.
    known: Option<(usize, usize)>,
    /// The values over whose median both headings are aligned, and the median once it is known.
    begin: Vec<f64>,
    aligned: Option<f64>,
    /// Medians of blocks that wait for the alignment.
    waiting: Vec<Option<f64>>,
    errors: Vec<Option<f64>>,
    changes: Changes<BLOCK_S>,
}

impl AgainstCourse {
    /// Adds a sample: the estimated yaw rate, rad/s, and the course, rad.
    pub fn add(&mut self, rate: f64, course: Option<f64>) {
        let off = self.off.add(rate, course);
        let at = self.samples;
        self.samples += 1;
        if let Some(off) = off {
            let (first, _) = self.known.unwrap_or((at, at));
            self.known = Some((first, at));
            if at - first < ALIGNED {
                self.begin.push(off);
            }
        }
        let median = self.blocks.add(off);
        if self.aligned.is_none() && self.known.is_some_and(|(first, _)| at + 1 - first >= ALIGNED) {
            self.align();
        }
        median.into_iter().for_each(|median| self.block(median));
    }

    /// The errors so far; `None` for less than 20 s of course.
    pub fn errors(mut self) -> Option<Errors> {
        let (first, last) = self.known?;
        self.end();
        let enough = last - first + SECOND >= ALIGNED;
        let end = self.errors.iter().flatten().last()?;
        Some(self.changes.errors(*end)).filter(|_| enough)
    }

    /// Returns the median error of each block of [`BLOCK_S`] seconds, rad.
    pub fn finish(mut self) -> Vec<Option<f64>> {
        self.end();
        self.errors
    }

    fn end(&mut self) {
        if self.aligned.is_none() {
            self.align();
        }
        let median = self.blocks.end();
        median.into_iter().for_each(|median| self.block(median));
    }

    fn align(&mut self) {
        self.aligned = median(std::mem::take(&mut self.begin));
        for median in std::mem::take(&mut self.waiting) {
            self.block(median);
        }
    }

    fn block(&mut self, median: Option<f64>) {
        let error = match (median, self.aligned) {
            // A block without a course needs no alignment, unless one before it waits.
            (None, _) if self.waiting.is_empty() => None,
            (median, None) => return self.waiting.push(median),
            (median, Some(aligned)) => median.map(|median| median - aligned),
        };
        self.errors.push(error);
        self.changes.add(error);
    }
}

/// The mean bias of a gyro over a drive, in progress: the slope of its heading less the course.
#[derive(Debug, Clone, Copy, Default)]
pub struct BiasByCourse {
    off: OffCourse,
    samples: usize,
    first: Option<f64>,
    last: f64,
    count: f64,
    mean: [f64; 2],
    both: f64,
    square: f64,
}

impl BiasByCourse {
    pub fn add(&mut self, gyro: f64, course: Option<f64>) {
        let time = self.samples as f64 * DT;
        self.samples += 1;
        let Some(off) = self.off.add(gyro, course) else { return };
        self.first = self.first.or(Some(time));
        self.last = time;
        self.count += 1.0;
        let before = time - self.mean[0];
        self.mean[0] += before / self.count;
        self.mean[1] += (off - self.mean[1]) / self.count;
        self.square += before * (time - self.mean[0]);
        self.both += before * (off - self.mean[1]);
    }

    /// The bias, rad/s; `None` if less than 20 s of course are known.
    pub fn get(&self) -> Option<f64> {
        let known = self.last - self.first?;
        (known >= ALIGNED as f64 * DT).then_some(self.both / self.square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_rate(reference: &[f64], estimate: &[f64]) -> Option<Errors> {
        let mut against = AgainstRate::default();
        reference.iter().zip(estimate).for_each(|(truth, rate)| against.add(*rate, *truth));
        against.errors()
    }

    fn by_course(course: &[Option<f64>], rate: f64) -> Option<Errors> {
        let mut against = AgainstCourse::default();
        course.iter().for_each(|course| against.add(rate, *course));
        against.errors()
    }

    fn close(figure: Option<f64>, due: f64) {
        let figure = figure.expect("a figure");
        assert!((figure - due).abs() < 1e-9, "{figure} is not {due}");
    }

    fn bias(gyro: f64, course: &[Option<f64>]) -> Option<f64> {
        let mut bias = BiasByCourse::default();
        course.iter().for_each(|course| bias.add(gyro, *course));
        bias.get()
    }

    #[test]
    fn a_constant_bias_grows_with_the_window() {
        let error = by_rate(&[0.3; 12_050], &[0.301; 12_050]).expect("whole seconds").figures;
        close(error.mean_1s_rad, 0.001);
        close(error.mean_60s_rad, 0.06);
        close(error.final_rad, 0.1205);
        let seconds = (0..=120).map(|k| 1e-6 * f64::from(k * k)).sum::<f64>() / 121.0;
        close(error.rms_rad, seconds.sqrt());
    }

    #[test]
    fn a_short_drive_has_no_long_window() {
        let error = by_rate(&[0.0; 500], &[0.0; 500]).expect("five seconds").figures;
        assert_eq!((error.mean_1s_rad, error.mean_60s_rad), (Some(0.0), None));
        assert_eq!(by_rate(&[0.0; 99], &[0.0; 99]), None);
    }

    /// The vehicle drives in circles for two minutes. The course of each second is wrapped, has an arbitrary zero, a
    /// gap of half a minute and outliers; the gyro is off by 0.001 rad/s.
    #[test]
    fn the_error_against_a_course_is_found() {
        let (turn, bias) = (0.5, 0.001);
        let course: Vec<Option<f64>> = (1..=12_000)
            .map(|k| {
                let known = k % 100 == 0 && !(4_000..7_000).contains(&k);
                let outlier = if k % 1_700 == 0 { 1.0 } else { 0.0 };
                known.then(|| wrap(2.0 + turn * f64::from(k) * DT + outlier))
            })
            .collect();
        let error = by_course(&course, turn + bias).expect("enough course").figures;
        assert_eq!(error.mean_1s_rad, None);
        let near = |figure: Option<f64>, due: f64| {
            let figure = figure.expect("a figure");
            assert!((figure - due).abs() < 2e-3, "{figure} is not {due}");
        };
        near(error.mean_60s_rad, 0.06);
        // The error grows from the middle of the first 20 s to that of the last 10 s.
        near(error.final_rad, 0.105);
        let blocks: Vec<f64> =
            [0, 1, 2, 3, 7, 8, 9, 10, 11].map(|k| bias * (10.0 * f64::from(k) - 5.0)).to_vec();
        near(error.rms_rad, mean(blocks.iter().map(|error| error * error)).expect("blocks").sqrt());
    }

    #[test]
    fn too_little_course_gives_nothing() {
        let course =
            |seconds: usize| (0..6_000).map(|k| (k < 100 * seconds).then_some(0.0)).collect::<Vec<_>>();
        assert_eq!(by_course(&course(10), 0.0), None);
        assert!(by_course(&course(20), 0.0).is_some());
        assert_eq!(by_course(&[None; 6_000], 0.0), None);
        assert_eq!(bias(0.1, &course(15)), None);
    }

    #[test]
    fn the_bias_is_the_slope() {
        let course: Vec<Option<f64>> =
            (0..6_000).map(|k| (k % 10 == 0).then(|| wrap(0.02 * f64::from(k)))).collect();
        let bias = bias(2.003, &course).expect("a minute");
        assert!((bias - 0.003).abs() < 1e-9, "{bias}");
    }

    #[test]
    fn a_reference_of_the_other_sign_is_noticed() {
        let rate: Vec<f64> = (0..6_000).map(|k| 0.4 * (f64::from(k) * 0.002).sin()).collect();
        let other: Vec<f64> = rate.iter().map(|rate| -rate).collect();
        let typical = |reference: &[f64]| by_rate(reference, &rate).and_then(|errors| errors.typical_10s);
        assert!(typical(&other).is_some_and(|off| off > PLAUSIBLE_10S_RAD));
        assert_eq!(typical(&rate), Some(0.0));
    }

    #[test]
    fn a_mean_is_over_the_drives_that_have_the_figure() {
        let [one, two] = [(Some(1.0), Some(3.0)), (None, Some(5.0))]
            .map(|(mean_1s_rad, rms_rad)| HeadingError { mean_1s_rad, rms_rad, ..HeadingError::default() });
        let mean = HeadingError::mean(&[one, two]);
        assert_eq!((mean.mean_1s_rad, mean.rms_rad, mean.final_rad), (Some(1.0), Some(4.0), None));
        assert_eq!((mean.compared(), two.compared()), (Some(1.0), Some(5.0)));
    }
}
