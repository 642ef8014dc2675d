//! The yaw errors of the paper's Table I: over one second, and at the end of the drive.

use crate::drive::DT;
use gyronet::sample::RATE_HZ;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Samples of a window of [`YawError::mean_1s_rad`].
pub const WINDOW: usize = RATE_HZ as usize;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct YawError {
    /// Mean absolute error of the yaw change over consecutive, non-overlapping 1 s windows. An incomplete window does
    /// not count.
    pub mean_1s_rad: f64,
    /// Absolute error of the yaw at the end, wrapped to at most pi.
    pub final_rad: f64,
    /// Absolute error of the yaw at the end, not wrapped.
    pub final_unwrapped_rad: f64,
}

impl YawError {
    /// Compares a yaw rate with the true one, sample by sample, both in rad/s.
    ///
    /// Returns `None` if there is no complete window, or the two differ in length.
    pub fn new(estimate: &[f64], reference: &[f64]) -> Option<Self> {
        let mut sums = YawSums::default();
        estimate.iter().zip(reference).for_each(|(rate, truth)| sums.add(*rate, *truth));
        sums.error().filter(|_| estimate.len() == reference.len())
    }

    /// Returns the mean of each error over several drives; `None` without drives.
    pub fn mean(errors: &[Self]) -> Option<Self> {
        let count = (!errors.is_empty()).then_some(errors.len() as f64)?;
        let mean = |of: fn(&Self) -> f64| errors.iter().map(of).sum::<f64>() / count;
        Some(Self {
            mean_1s_rad: mean(|error| error.mean_1s_rad),
            final_rad: mean(|error| error.final_rad),
            final_unwrapped_rad: mean(|error| error.final_unwrapped_rad),
        })
    }
}

#[derive(Debug, Clone, Copy, Default)]
pub struct YawSums {
    samples: usize,
    window: f64,
    windows: f64,
    total: f64,
}

impl YawSums {
    /// Adds a sample: the estimated and the true yaw rate, rad/s.
    pub fn add(&mut self, rate: f64, truth: f64) {
        let error = (rate - truth) * DT;
        self.samples += 1;
        self.total += error;
        self.window += error;
        if self.samples.is_multiple_of(WINDOW) {
            self.windows += std::mem::take(&mut self.window).abs();
        }
    }

    /// The error so far; `None` without a complete window.
    pub fn error(&self) -> Option<YawError> {
        let count = (self.samples >= WINDOW).then_some((self.samples / WINDOW) as f64)?;
        Some(YawError {
            mean_1s_rad: self.windows / count,
            final_rad: wrap(self.total).abs(),
            final_unwrapped_rad: self.total.abs(),
        })
    }
}

/// Returns the angle after each sample of a rate, rad.
pub fn integral(rates: &[f64]) -> Vec<f64> {
    let step = |angle: &mut f64, rate: &f64| {
        *angle += rate * DT;
        Some(*angle)
    };
    rates.iter().scan(0.0, step).collect()
}

/// Wraps an angle to -pi to pi.
pub fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    }

    #[test]
    fn opposite_errors_cancel_in_the_end_but_not_in_the_mean() {
        // The error is +0.02 rad/s for one second, -0.01 for another, then 0.04 for half a second.
        let estimate: Vec<f64> = (0..250)
            .map(|k| {
                0.3 + if k < 100 {
                    0.02
                } else if k < 200 {
                    -0.01
                } else {
                    0.04
                }
            })
            .collect();
        let error = YawError::new(&estimate, &vec![0.3; 250]).unwrap();
        close(error.mean_1s_rad, 0.015);
        close(error.final_rad, 0.02 - 0.01 + 0.02);
        close(error.final_unwrapped_rad, error.final_rad);
    }

    #[test]
    fn the_final_error_wraps() {
        let error = YawError::new(&[-2.0; 300], &[0.0; 300]).unwrap();
        close(error.final_unwrapped_rad, 6.0);
        close(error.final_rad, TAU - 6.0);
        close(error.mean_1s_rad, 2.0);
    }

    #[test]
    fn less_than_a_window_is_nothing() {
        assert_eq!(YawError::new(&[0.0; 99], &[0.0; 99]), None);
        assert_eq!(YawError::new(&[0.0; 100], &[0.0; 101]), None);
    }

    #[test]
    fn mean_of_drives() {
        let drive = |x| YawError { mean_1s_rad: x, final_rad: 2.0 * x, final_unwrapped_rad: 3.0 * x };
        assert_eq!(YawError::mean(&[drive(1.0), drive(3.0)]), Some(drive(2.0)));
        assert_eq!(YawError::mean(&[]), None);
    }
}
