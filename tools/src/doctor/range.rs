//! Finds saturated readings, stuck readings, and a gyro in degrees per second.

use super::finding::Finding;
use super::recording::{Rows, SECOND};
use super::remedy;

/// Consecutive samples at the same extreme value that count as saturated.
const CLIPPED_RUN: usize = 3;
/// Fastest turn of a vehicle, also of a small one, rad/s as the mean of a second.
const FASTEST: f64 = 6.0;
/// Consecutive samples that are equal on all axes and count as stuck.
const STUCK_RUN: usize = 5;

pub fn findings(rows: &Rows) -> Vec<Finding> {
    let degrees = 180.0 / std::f64::consts::PI;
    let mut findings = vec![
        limit("gyro range", &rows.rate, "deg/s", degrees),
        limit("accelerometer range", &rows.force, "m/s^2", 1.0),
    ];
    let turn =
        |second: &[[f64; 3]]| (second.iter().map(|rate| rate[2]).sum::<f64>() / second.len() as f64).abs();
    let fastest = rows.rate.chunks_exact(SECOND).map(turn).fold(0.0, f64::max);
    if fastest > FASTEST {
        let unit = remedy::imu(rows, "deg/s");
        let text = format!("It turns by {fastest:.1} rad in a second, as no vehicle does: {unit}.");
        findings.push(Finding::bad("gyro unit", text));
    }
    let both: Vec<_> = rows.rate.iter().zip(&rows.force).collect();
    let stuck = in_runs(&both, |a, b| a == b, STUCK_RUN);
    if stuck > 0 {
        let text = format!("{stuck} samples repeat on all six axes, {STUCK_RUN} or more in a row.");
        findings.push(Finding::bad("stuck samples", text));
    }
    findings
}

/// Finds saturated readings; `scale` converts the values to the unit that is shown.
fn limit(what: &'static str, values: &[[f64; 3]], unit: &str, scale: f64) -> Finding {
    let largest = values.iter().flatten().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let shown = scale * largest;
    let clipped = |axis: usize| {
        move |a: &[f64; 3], b: &[f64; 3]| {
            a[axis] == b[axis] && a[axis].abs() >= 0.999 * largest && largest > 0.0
        }
    };
    match (0..3).map(|axis| in_runs(values, clipped(axis), CLIPPED_RUN)).sum::<usize>() {
        0 => Finding::good(what, format!("Largest reading {shown:.1} {unit}; no sign of saturation.")),
        count => Finding::bad(
            what,
            format!(
                "{count} samples at the limit of {shown:.1} {unit}, several in a row: the sensor saturates."
            ),
        ),
    }
}

/// Counts the elements in runs of at least `least` alike elements.
fn in_runs<T>(values: &[T], alike: impl Fn(&T, &T) -> bool, least: usize) -> usize {
    values.chunk_by(|a, b| alike(a, b)).filter(|run| run.len() >= least).map(<[T]>::len).sum()
}
