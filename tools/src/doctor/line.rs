//! Fits a line to what two sources say of the same seconds, and names the units that its slope gives away.

use super::recording::{Rows, SECOND};
use crate::drive::DT;

/// Largest share by which a slope may differ from a confusion of units.
const NEAR: f64 = 0.15;
pub const KMH: f64 = 3.6;
pub const DEGREES: f64 = 180.0 / std::f64::consts::PI;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    pub slope: f64,
    /// Standard deviation of the slope, by the scatter of y.
    pub sigma: f64,
    pub correlation: f64,
    /// y where x is zero.
    pub offset: f64,
}

impl Line {
    /// Fits the line; `None` for fewer than three points, or if x or y never changes.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
        let (xx, xy, yy) = (
            mean(&|p| (p.0 - mx).powi(2)),
            mean(&|p| (p.0 - mx) * (p.1 - my)),
            mean(&|p| (p.1 - my).powi(2)),
        );
        let slope = xy / xx;
        let known = points.len() > 2 && xx > 0.0 && yy > 0.0;
        known.then(|| Self {
            slope,
            sigma: ((yy - slope * xy).max(0.0) / (xx * (count - 2.0))).sqrt(),
            correlation: xy / (xx * yy).sqrt(),
            offset: my - slope * mx,
        })
    }
}

pub fn confused(ratio: f64, units: f64) -> bool {
    (ratio / units - 1.0).abs() < NEAR
}

/// The turn of the gyro about z from the first row to each row, rad.
pub fn turned(rows: &Rows) -> Vec<f64> {
    let mut angle = 0.0;
    let sum = |rate: &[f64; 3]| {
        angle += rate[2] * DT;
        angle
    };
    rows.rate.iter().map(sum).collect()
}

/// The means of two values over the seconds in which at least so many rows have both.
pub fn seconds(rows: &Rows, least: usize, of: impl Fn(usize) -> Option<(f64, f64)>) -> Vec<(f64, f64)> {
    let second = |from: usize| {
        let known: Vec<_> = (from..(from + SECOND).min(rows.len())).filter_map(&of).collect();
        let count = known.len() as f64;
        let sum = known.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0, y + p.1));
        (known.len() >= least).then_some((sum.0 / count, sum.1 / count))
    };
    (0..rows.len()).step_by(SECOND).filter_map(second).collect()
}
