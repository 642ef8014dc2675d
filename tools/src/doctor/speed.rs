//! Compares the speeds: wheels with GNSS, and speed times yaw rate with the force to the side.

use super::finding::Finding;
use super::line::{DEGREES, KMH, Line, confused, seconds};
use super::recording::{Rows, sorted};
use super::{remedy, wheels};

const WHAT: &str = "speed";
/// Fewest seconds that are compared, and least correlation.
const LEAST: (usize, f64) = (10, 0.9);
/// Slower speeds, m/s, and slower turns, rad/s, are not compared.
const SLOW: (f64, f64) = (2.0, 0.03);
/// Yaw rate of a bend in which positions cut the way short, rad/s.
const BEND: f64 = 0.2;
/// Largest ratio of the upper to the lower quartile.
const SPREAD: f64 = 1.3;
/// Error of the rolling radius that is worth a word.
const RADIUS: f64 = 0.02;

pub fn finding(rows: &Rows) -> Option<Finding> {
    let by_wheels = |k: usize| {
        let known: Vec<f64> = rows.wheels.iter().filter_map(|wheel| wheel[k]).collect();
        (!known.is_empty()).then(|| rows.vehicle.radius_m() * known.iter().sum::<f64>() / known.len() as f64)
    };
    let radius =
        |slope| format!("radius_m = {:.3} in the vehicle file fits", rows.vehicle.radius_m() / slope);
    // A speed by positions is late and smooth, which bends a line, but not the middle of the ratios; in bends it is small.
    let both =
        |k: usize| Some((rows.speed[k]?, by_wheels(k)?.abs())).filter(|_| rows.rate[k][2].abs() < BEND);
    let both = seconds(rows, 1, both);
    let ratios = sorted(both.iter().filter(|(gnss, _)| *gnss > SLOW.0).map(|(gnss, wheels)| wheels / gnss));
    let part = |quarters: usize| ratios.get(quarters * ratios.len() / 4).copied().unwrap_or_default();
    if ratios.len() >= LEAST.0 && part(3) < SPREAD * part(1) {
        let ratio = part(2);
        let text = format!("Wheels turn {ratio:.3} times as fast as the speed by GNSS");
        return Some(if confused(ratio, KMH) {
            Finding::bad(WHAT, format!("{text}: they are in km/h; {}.", wheels::in_kmh(rows)))
        } else if !(0.6..1.6).contains(&ratio) {
            Finding::bad(WHAT, format!("{text}: their unit is wrong, or {}.", radius(ratio)))
        } else if (ratio - 1.0).abs() > RADIUS {
            Finding::note(WHAT, format!("{text}: {}.", radius(ratio)))
        } else {
            Finding::good(WHAT, format!("{text}."))
        });
    }
    // In a bend the force to the left is the speed times the yaw rate.
    let side = |k: usize| {
        let (speed, rate) = (rows.speed[k].or_else(|| by_wheels(k))?, rows.rate[k][2]);
        Some((speed * rate, rows.force[k][1]))
    };
    let sides = seconds(rows, 1, side);
    let enough = sides.iter().filter(|(x, _)| x.abs() > SLOW.0 * SLOW.1).count() >= LEAST.0;
    let line = Line::of(&sides).filter(|line| enough && line.correlation > LEAST.1)?;
    let ratio = 1.0 / line.slope;
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
