//! Compares the speeds: wheels with GNSS, and speed times yaw rate with the force to the side.

use super::finding::Finding;
use super::line::{DEGREES, KMH, Line, confused, seconds};
use super::recording::Rows;
use super::{remedy, wheels};

const WHAT: &str = "speed";
/// Fewest seconds that are compared, and least correlation.
const LEAST: (usize, f64) = (10, 0.9);
/// Slower speeds, m/s, and slower turns, rad/s, are not compared.
const SLOW: (f64, f64) = (2.0, 0.03);
/// Error of the rolling radius that is worth a word.
const RADIUS: f64 = 0.02;

/// The finding; `None` without a speed.
pub fn finding(rows: &Rows) -> Option<Finding> {
    let by_wheels = |k: usize| {
        let known: Vec<f64> = rows.wheels.iter().filter_map(|wheel| wheel[k]).collect();
        (!known.is_empty()).then(|| rows.vehicle.radius_m() * known.iter().sum::<f64>() / known.len() as f64)
    };
    let gnss = fit(&seconds(rows, |k| Some((rows.speed[k]?, by_wheels(k)?.abs()))), SLOW.0);
    if let Some(Line { slope, .. }) = gnss {
        let text = format!("Wheels turn {slope:.3} times as fast as the speed by GNSS");
        return Some(if confused(slope, KMH) {
            Finding::bad(WHAT, format!("{text}: they are in km/h; {}.", wheels::in_kmh(rows)))
        } else if !(0.6..1.6).contains(&slope) {
            Finding::bad(WHAT, format!("{text}: their unit or radius_m is wrong."))
        } else if (slope - 1.0).abs() > RADIUS {
            let radius = rows.vehicle.radius_m() / slope;
            Finding::note(WHAT, format!("{text}: radius_m = {radius:.3} in the vehicle file fits."))
        } else {
            Finding::good(WHAT, format!("{text}."))
        });
    }
    // In a bend the force to the left is the speed times the yaw rate.
    let side = |k: usize| {
        let (speed, rate) = (rows.speed[k].or_else(|| by_wheels(k))?, rows.rate[k][2]);
        Some((speed * rate, rows.force[k][1]))
    };
    let Line { slope, .. } = fit(&seconds(rows, side), SLOW.0 * SLOW.1)?;
    let ratio = 1.0 / slope;
    let text = format!("Speed times yaw rate is {ratio:.2} times the force to the side");
    Some(if confused(ratio, KMH) {
        Finding::bad(WHAT, format!("{text}: the wheels are in km/h; {}.", wheels::in_kmh(rows)))
    } else if confused(ratio, DEGREES) {
        Finding::bad(WHAT, format!("{text}: {}.", remedy::imu(rows, "deg/s")))
    } else if (0.7..1.4).contains(&ratio) {
        Finding::good(WHAT, format!("{text}."))
    } else {
        Finding::note(WHAT, format!("{text}: a unit, the radius or the mounting is wrong."))
    })
}

/// The line through seconds of which enough have an x above `least`, if it is one.
fn fit(seconds: &[(f64, f64)], least: f64) -> Option<Line> {
    let enough = seconds.iter().filter(|(x, _)| x.abs() > least).count() >= LEAST.0;
    Line::of(seconds).filter(|line| enough && line.correlation > LEAST.1)
}
