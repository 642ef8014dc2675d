//! Compares wheels and gyro: the speed difference of right and left, over the track, is the yaw rate.

use super::finding::Finding;
use super::recording::{Rows, SECOND};

/// Fewest seconds of turning for a comparison.
const LEAST_TURNING_S: usize = 5;
/// Mean yaw rate above which a second counts as turning, rad/s.
const TURNS: f64 = 0.05;

/// The fitted line of a wheel pair's rate difference over the yaw rate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pair {
    /// Rate difference, rad/s, per rad/s of yaw rate: the track over the radius.
    slope: f64,
    correlation: f64,
    /// Rate difference without a turn, rad/s.
    offset: f64,
}

pub fn finding(rows: &Rows) -> Finding {
    let what = "wheels";
    let known = rows.wheels.iter().filter(|wheel| wheel.iter().any(Option::is_some)).count();
    if known == 0 {
        return Finding::note(what, "None: no standstill by the wheels, and no speed.");
    }
    let Some(Pair { slope, correlation, offset }) = compare(rows) else {
        return Finding::note(
            what,
            format!(
                "{known} recorded; no axle has both wheels, at different speeds, in enough turns to compare them with the gyro."
            ),
        );
    };
    let radius = rows.vehicle.radius_m();
    let track = slope * radius;
    let named = rows.vehicle.wheels.track_m.map(|track| format!(" ({track} m in the vehicle file)"));
    let text = format!(
        "{known} recorded; left and right against the gyro: correlation {correlation:.3}, track {track:.2} m at a radius of {radius} m{}, {offset:+.3} rad/s apart when driving straight",
        named.unwrap_or_default()
    );
    if correlation > 0.9 && (0.2..4.0).contains(&track) {
        Finding::good(what, format!("{text}."))
    } else if correlation < -0.9 {
        Finding::bad(what, format!("{text}: left and right are swapped, or z is down."))
    } else {
        Finding::note(what, format!("{text}: usable for standstill and speed, not for the yaw rate."))
    }
}

/// Compares means over seconds. Wheels 1 and 2 are right, 3 and 4 left, 1 and 3 at the front. Returns `None` if no
/// axle has both wheels or the drive hardly turns.
fn compare(rows: &Rows) -> Option<Pair> {
    for (right, left) in [(1, 3), (0, 2)] {
        let (right, left) = (&rows.wheels[right], &rows.wheels[left]);
        let seconds = (0..rows.len()).step_by(SECOND).filter_map(|from| {
            let span = from..(from + SECOND).min(rows.len());
            let mean = |wheel: &[Option<f64>]| {
                let known = || wheel.iter().flatten();
                (known().count() >= 5).then(|| known().sum::<f64>() / known().count() as f64)
            };
            let (right, left) = (mean(&right[span.clone()])?, mean(&left[span.clone()])?);
            Some((rows.mean_yaw_rate(span), right - left))
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
