//! This module computes the heading error of a yaw rate over 1 s, 10 s, 60 s and a whole drive, against a reference
//! yaw rate or a course.
//!
//! A reference yaw rate gives every figure. A course over ground (GNSS) is the direction of travel, not the heading:
//! latency, side slip and noise give it errors of 0.05 to 0.1 rad from one second to the next. So errors against a
//! course are medians over 10 s, which still scatter by 0.02 rad. A course cannot judge 1 s and 10 s.

use super::metrics::{integral, wrap};
use crate::drive::DT;
use gyronet::sample::RATE_HZ;
use serde::Serialize;

/// Samples per second.
const SECOND: usize = RATE_HZ as usize;
/// Seconds over which the median of the error against a course is taken.
pub const BLOCK_S: usize = 10;
/// Fewest values of the course for a median.
const BLOCK_VALUES: usize = 3;
/// Seconds of known course over whose median both headings are aligned.
const ALIGNED_S: usize = 20;
/// Largest [`HeadingErrorSeries::typical_10s`] that a bias can explain, rad.
pub const PLAUSIBLE_10S_RAD: f64 = 0.5;

/// The reference of a drive.
#[derive(Debug, Clone, PartialEq)]
pub enum Reference {
    /// The true yaw rate of each sample, rad/s (`ref_gyr_z`).
    Rate(Vec<f64>),
    /// The course of some samples, rad to the left (`ref_yaw`).
    Course(Vec<Option<f64>>),
}

impl Reference {
    /// Returns the name of the reference's column.
    #[must_use]
    pub fn column(&self) -> &'static str {
        match self {
            Self::Rate(_) => "ref_gyr_z",
            Self::Course(_) => "ref_yaw",
        }
    }

    /// Returns the yaw rates; `None` for a course.
    #[must_use]
    pub fn rate(&self) -> Option<&[f64]> {
        match self {
            Self::Rate(rate) => Some(rate),
            Self::Course(_) => None,
        }
    }

    /// Returns the heading error of an estimated yaw rate over time; `None` for less than a second of yaw rate or
    /// less than 20 s of course.
    #[must_use]
    pub fn errors(&self, estimate: &[f64]) -> Option<HeadingErrorSeries> {
        match self {
            Self::Rate(reference) => against_rate(estimate, reference),
            Self::Course(course) => against_course(estimate, course),
        }
    }
}

/// The heading error over a drive.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadingErrorSeries {
    /// Seconds from one error to the next.
    step_s: usize,
    /// The shortest window that the reference can judge, s.
    shortest_s: usize,
    /// The errors, rad; `None` while the reference is unknown.
    errors: Vec<Option<f64>>,
    /// The error at the end, rad.
    last: f64,
}

/// The figures of a heading error; `None` if the reference cannot give a figure, or the drive is too short for it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct HeadingError {
    /// Mean absolute error of the heading change over 1 s; a window starts every second.
    pub mean_1s_rad: Option<f64>,
    /// Mean absolute error of the heading change over 10 s.
    pub mean_10s_rad: Option<f64>,
    /// Mean absolute error of the heading change over 60 s.
    pub mean_60s_rad: Option<f64>,
    /// RMS of the error over the drive.
    pub rms_rad: Option<f64>,
    /// The absolute error at the end, wrapped to at most pi.
    pub final_rad: Option<f64>,
}

impl HeadingErrorSeries {
    /// Returns the figures.
    #[must_use]
    pub fn figures(&self) -> HeadingError {
        let over = |seconds: usize| {
            let known = seconds >= self.shortest_s;
            mean(self.changes(seconds).filter(|_| known).map(f64::abs))
        };
        HeadingError {
            mean_1s_rad: over(1),
            mean_10s_rad: over(10),
            mean_60s_rad: over(60),
            rms_rad: mean(self.errors.iter().flatten().map(|error| error * error)).map(f64::sqrt),
            final_rad: Some(wrap(self.last).abs()),
        }
    }

    /// Returns the median absolute change of the error in 10 s, rad. It is large if rate and reference differ in sign
    /// or unit, or are not from the same drive.
    #[must_use]
    pub fn typical_10s(&self) -> Option<f64> {
        median(self.changes(10).map(f64::abs).collect())
    }

    /// Returns the changes of the error over windows of this length, one from each step.
    fn changes(&self, seconds: usize) -> impl Iterator<Item = f64> {
        let later = self.errors.iter().skip(seconds / self.step_s);
        self.errors.iter().zip(later).filter_map(|(from, to)| Some((*to)? - (*from)?))
    }
}

impl HeadingError {
    /// Returns the figure by which methods are compared: the 1 s error, or the RMS over the drive if there is none.
    #[must_use]
    pub fn compared(&self) -> Option<f64> {
        self.mean_1s_rad.or(self.rms_rad)
    }

    /// Returns the mean of each figure over the drives that have it.
    #[must_use]
    pub fn mean(errors: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> Option<f64>| mean(errors.iter().filter_map(of));
        Self {
            mean_1s_rad: mean(|error| error.mean_1s_rad),
            mean_10s_rad: mean(|error| error.mean_10s_rad),
            mean_60s_rad: mean(|error| error.mean_60s_rad),
            rms_rad: mean(|error| error.rms_rad),
            final_rad: mean(|error| error.final_rad),
        }
    }
}

fn against_rate(estimate: &[f64], reference: &[f64]) -> Option<HeadingErrorSeries> {
    if estimate.len() != reference.len() || estimate.len() < SECOND {
        return None;
    }
    let off: Vec<f64> = estimate.iter().zip(reference).map(|(estimate, truth)| estimate - truth).collect();
    let each = integral(&off);
    let seconds = each.iter().skip(SECOND - 1).step_by(SECOND).map(|error| Some(*error));
    let errors = std::iter::once(Some(0.0)).chain(seconds).collect();
    Some(HeadingErrorSeries { step_s: 1, shortest_s: 1, errors, last: *each.last()? })
}

fn against_course(estimate: &[f64], course: &[Option<f64>]) -> Option<HeadingErrorSeries> {
    let off = off_course(estimate, course);
    let known: Vec<(usize, f64)> = off.iter().enumerate().filter_map(|(k, off)| Some((k, (*off)?))).collect();
    let (first, _) = known.first()?;
    let begin = known.iter().take_while(|(k, _)| k - first < ALIGNED_S * SECOND).map(|(_, off)| *off);
    let aligned = median(begin.collect())?;
    let errors: Vec<Option<f64>> = medians(&off).map(|off| Some(off? - aligned)).collect();
    let last = errors.iter().rev().find_map(|error| *error)?;
    let (end, _) = known.last()?;
    let enough = end - first + SECOND >= ALIGNED_S * SECOND;
    enough.then_some(HeadingErrorSeries { step_s: BLOCK_S, shortest_s: 6 * BLOCK_S, errors, last })
}

/// Returns the integral of a yaw rate less the course, where the course is known. The difference is unwrapped instead
/// of the course, because the difference changes slowly even if the vehicle turns while the course is unknown.
#[must_use]
pub fn off_course(estimate: &[f64], course: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut last = None;
    let off = |(yaw, course): (f64, &Option<f64>)| {
        let off = yaw - (*course)?;
        let near = last.unwrap_or(off);
        last = Some(near + wrap(off - near));
        last
    };
    integral(estimate).into_iter().zip(course).map(off).collect()
}

/// Returns the median of each block of [`BLOCK_S`] seconds; `None` if too few values are known.
pub fn medians(off: &[Option<f64>]) -> impl Iterator<Item = Option<f64>> {
    off.chunks(BLOCK_S * SECOND).map(|block| {
        let values: Vec<f64> = block.iter().flatten().copied().collect();
        if values.len() < BLOCK_VALUES { None } else { median(values) }
    })
}

/// Returns the mean bias of a gyro over a drive, rad/s: the slope of its heading less the course. Returns `None` if
/// less than 20 s of course are known.
#[must_use]
pub fn bias_by_course(gyro: &[f64], course: &[Option<f64>]) -> Option<f64> {
    let off = off_course(gyro, course);
    let known = || off.iter().enumerate().filter_map(|(k, off)| Some((k as f64 * DT, (*off)?)));
    let (first, last) = (known().next()?.0, known().next_back()?.0);
    let time = mean(known().map(|(time, _)| time))?;
    let (both, square) = known().fold((0.0, 0.0), |(both, square), (at, off)| {
        (both + (at - time) * off, square + (at - time) * (at - time))
    });
    (last - first >= ALIGNED_S as f64).then_some(both / square)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    (count > 0.0).then_some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(figure: Option<f64>, due: f64) {
        let figure = figure.expect("a figure");
        assert!((figure - due).abs() < 1e-9, "{figure} is not {due}");
    }

    #[test]
    fn a_constant_bias_grows_with_the_window() {
        let error =
            Reference::Rate(vec![0.3; 12_050]).errors(&vec![0.301; 12_050]).expect("whole seconds").figures();
        close(error.mean_1s_rad, 0.001);
        close(error.mean_10s_rad, 0.01);
        close(error.mean_60s_rad, 0.06);
        close(error.final_rad, 0.1205);
        let seconds = (0..=120).map(|k| 1e-6 * f64::from(k * k)).sum::<f64>() / 121.0;
        close(error.rms_rad, seconds.sqrt());
    }

    #[test]
    fn a_short_drive_has_no_long_window() {
        let error = Reference::Rate(vec![0.0; 500]).errors(&vec![0.0; 500]).expect("five seconds").figures();
        assert_eq!((error.mean_1s_rad, error.mean_10s_rad, error.mean_60s_rad), (Some(0.0), None, None));
        assert_eq!(Reference::Rate(vec![0.0; 99]).errors(&[0.0; 99]), None);
        assert_eq!(Reference::Rate(vec![0.0; 200]).errors(&[0.0; 199]), None);
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
        let error =
            Reference::Course(course).errors(&vec![turn + bias; 12_000]).expect("enough course").figures();
        assert_eq!((error.mean_1s_rad, error.mean_10s_rad), (None, None));
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
        assert_eq!(Reference::Course(course(10)).errors(&[0.0; 6_000]), None);
        assert!(Reference::Course(course(20)).errors(&[0.0; 6_000]).is_some());
        assert_eq!(Reference::Course(vec![None; 6_000]).errors(&[0.0; 6_000]), None);
        assert_eq!(bias_by_course(&[0.1; 6_000], &course(15)), None);
    }

    #[test]
    fn the_bias_is_the_slope() {
        let course: Vec<Option<f64>> =
            (0..6_000).map(|k| (k % 10 == 0).then(|| wrap(0.02 * f64::from(k)))).collect();
        let bias = bias_by_course(&vec![2.003; 6_000], &course).expect("a minute");
        assert!((bias - 0.003).abs() < 1e-9, "{bias}");
    }

    #[test]
    fn a_reference_of_the_other_sign_is_noticed() {
        let rate: Vec<f64> = (0..6_000).map(|k| 0.4 * (f64::from(k) * 0.002).sin()).collect();
        let other: Vec<f64> = rate.iter().map(|rate| -rate).collect();
        let typical =
            |reference: Vec<f64>| Reference::Rate(reference).errors(&rate).and_then(|e| e.typical_10s());
        assert!(typical(other).is_some_and(|off| off > PLAUSIBLE_10S_RAD));
        assert_eq!(typical(rate.clone()), Some(0.0));
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
