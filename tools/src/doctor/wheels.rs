//! The wheels against the gyro: the difference of left and right, over the track, is the yaw rate.

use super::recording::Rows;

/// Least seconds of turning that say something.
const LEAST_TURNING_S: usize = 5;
/// A second turns from this rate on, rad/s.
const TURNS: f64 = 0.05;

/// The line through the differences of a pair of wheels over the yaw rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Difference, rad/s, of one rad/s of yaw rate: the track over the radius.
    pub slope: f64,
    pub correlation: f64,
    /// Difference without a yaw rate, rad/s.
    pub offset: f64,
}

/// Compares means over seconds; wheels 1 and 2 are right, 3 and 4 left, 1 and 3 at the front. `None` where no axle has both
/// wheels or the drive hardly turns.
pub fn compare(rows: &Rows) -> Option<Pair> {
    for (right, left) in [(1, 3), (0, 2)] {
        let (right, left) = (&rows.wheels[right], &rows.wheels[left]);
        let seconds = (0..rows.len()).step_by(100).filter_map(|from| {
            let span = from..(from + 100).min(rows.len());
            let mean = |wheel: &[Option<f64>]| {
                let known = || wheel.iter().flatten();
                (known().count() >= 5).then(|| known().sum::<f64>() / known().count() as f64)
            };
            let (right, left) = (mean(&right[span.clone()])?, mean(&left[span.clone()])?);
            let rate = rows.rate[span.clone()].iter().map(|rate| rate[2]).sum::<f64>() / span.len() as f64;
            Some((rate, right - left))
        });
        let seconds: Vec<(f64, f64)> = seconds.collect();
        if seconds.iter().filter(|(rate, _)| rate.abs() > TURNS).count() >= LEAST_TURNING_S {
            return line(&seconds);
        }
    }
    None
}

fn line(points: &[(f64, f64)]) -> Option<Pair> {
    let count = points.len() as f64;
    let (mx, my) =
        (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| of(p.0 - mx, p.1 - my)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let slope = xy / xx;
    let known = xx > 0.0 && yy > 0.0;
    known.then(|| Pair { slope, correlation: xy / (xx * yy).sqrt(), offset: my - slope * mx })
}
