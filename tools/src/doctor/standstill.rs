//! Finds the standstills of a recording: whole seconds with a quiet gyro and, if recorded, standing
//! wheels.

use super::finding::Finding;
use super::recording::{Rows, SECOND, sorted};
use crate::drive::DT;
use crate::drive::recording::WHEEL_STANDS;
use std::ops::Range;

/// Largest spread of the gyro in a second at rest: this multiple of the quietest seconds' spread, and the limit of
/// static initialisation on three axes together, rad/s.
const QUIET: (f64, f64) = (2.5, 0.0866);
/// The mean yaw rate of a second at rest may differ by this much from the median of all quiet seconds, rad/s.
const RESTING_RATE: f64 = 0.01;
/// Speed by GNSS of a vehicle that does not stand, m/s.
const DRIVES: f64 = 1.0;

/// Returns the standstills, and the number of seconds that are as quiet but in which the vehicle drove by its GNSS.
pub fn find(rows: &Rows) -> (Vec<Range<usize>>, usize) {
    let seconds = || (0..rows.len() / SECOND).map(|k| k * SECOND..(k + 1) * SECOND);
    let spreads: Vec<f64> = seconds().map(|second| spread(&rows.rate[second])).collect();
    let ranked = sorted(spreads.iter().copied());
    let Some(quietest) = ranked.get(ranked.len() / 100) else { return (Vec::new(), 0) };
    let limit = (QUIET.0 * quietest).min(QUIET.1);
    let quiet =
        seconds().zip(&spreads).filter(|(second, spread)| **spread <= limit && wheels_rest(rows, second));
    let quiet: Vec<(Range<usize>, f64)> =
        quiet.map(|(second, _)| (second.clone(), rows.mean_yaw_rate(second))).collect();
    // A slow turn is as quiet as a standstill, but its mean rate differs from the median of the quiet seconds.
    let means = sorted(quiet.iter().map(|(_, mean)| *mean));
    let bias = means.get(means.len() / 2).copied().unwrap_or_default();
    let (quiet, driven): (Vec<_>, Vec<_>) = quiet.into_iter().partition(|(second, _)| !drives(rows, second));
    let mut standstills: Vec<Range<usize>> = Vec::new();
    for (second, _) in quiet.into_iter().filter(|(_, mean)| (mean - bias).abs() < RESTING_RATE) {
        match standstills.last_mut() {
            Some(last) if last.end == second.start => last.end = second.end,
            _ => standstills.push(second),
        }
    }
    (standstills, driven.len())
}

fn spread(rates: &[[f64; 3]]) -> f64 {
    let variance = |axis: usize| {
        let mean = rates.iter().map(|rate| rate[axis]).sum::<f64>() / rates.len() as f64;
        rates.iter().map(|rate| (rate[axis] - mean).powi(2)).sum::<f64>() / rates.len() as f64
    };
    (variance(0) + variance(1) + variance(2)).sqrt()
}

fn wheels_rest(rows: &Rows, second: &Range<usize>) -> bool {
    rows.wheels.iter().all(|wheel| {
        let known = || wheel[second.clone()].iter().flatten();
        known().sum::<f64>().abs() / known().count().max(1) as f64 <= WHEEL_STANDS
    })
}

fn drives(rows: &Rows, second: &Range<usize>) -> bool {
    let speeds = sorted(rows.speed[second.clone()].iter().copied().flatten());
    speeds.get(speeds.len() / 2).is_some_and(|speed| *speed > DRIVES)
}

pub fn finding(rows: &Rows, (standstills, driven): (&[Range<usize>], usize)) -> Finding {
    let lengths = || standstills.iter().map(Range::len);
    let [total, longest] =
        [lengths().sum(), lengths().max().unwrap_or_default()].map(|rows: usize| rows as f64 * DT);
    let by =
        if rows.wheels.iter().flatten().any(Option::is_some) { "gyro and wheels" } else { "the gyro alone" };
    let mut text =
        format!("{} by {by}, {total:.0} s in total, the longest {longest:.0} s.", standstills.len());
    if driven > 0 {
        text += &format!(
            " {driven} s are as quiet, but driven by the GNSS speed: the gyro alone cannot tell stops."
        );
    }
    if standstills.is_empty() {
        Finding::note("standstills", text)
    } else {
        Finding::good("standstills", text)
    }
}
