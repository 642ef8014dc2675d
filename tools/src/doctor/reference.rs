//! Examines the reference, a true yaw rate or a course.

use super::align::{self, Offset};
use super::finding::{Finding, Verdict};
use super::recording::{Rows, SECOND};
use crate::drive::DT;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

const WHAT: &str = "reference";
/// Largest offset of a good reference from the gyro, s: of a yaw rate, and of a course.
const LATE: (f64, f64) = (0.015, 0.5);
/// Fewest seconds at rest from which the scatter is computed.
const LEAST_AT_REST: usize = 5;
/// Two courses this far apart or further give no yaw rate, s.
const COURSE_GAP: f64 = 2.0;

pub fn finding(rows: &Rows, standstill: Option<&Range<usize>>) -> Finding {
    let gyro = rows.series(|k| Some(rows.rate[k][2]));
    let rate = rows.series(|k| rows.reference[k]);
    let course = rows.series(|k| rows.course[k]);
    if !rate.is_empty() {
        let noise = standstill.map(|span| scatter(&rows.reference[span.clone()])).unwrap_or_default();
        of_rate(&gyro, &rate, 100.0 * rate.len() as f64 / rows.len() as f64, &noise)
    } else if !course.is_empty() {
        of_course(&gyro, &course)
    } else {
        Finding::note(WHAT, "None: the recording can neither judge a method nor train a network.")
    }
}

fn of_rate(gyro: &align::Rate, rate: &align::Rate, percent: f64, noise: &str) -> Finding {
    let rows = format!("A yaw rate in {percent:.0} % of the rows");
    match align::offset(gyro, rate) {
        Ok(Offset { seconds, coefficient }) => Finding {
            what: WHAT,
            verdict: if seconds.abs() < LATE.0 { Verdict::Good } else { Verdict::Bad },
            text: format!("{rows}, correlation with the gyro {coefficient:.4}, {}{noise}.", delay(seconds)),
        },
        Err(reason) => Finding::bad(WHAT, format!("{rows} that does not fit the gyro: {reason}{noise}.")),
    }
}

/// Returns the text for a clock offset: by how much the reference is early or late.
fn delay(seconds: f64) -> String {
    let word = if seconds > 0.0 { "early" } else { "late" };
    format!("{:.1} ms {word}", 1e3 * seconds.abs())
}

/// Returns the text for the scatter of the reference's 1 s angles at rest; empty if the rest is too short.
fn scatter(reference: &[Option<f64>]) -> String {
    let angles: Vec<f64> =
        reference.chunks_exact(SECOND).map(|second| second.iter().flatten().sum::<f64>() * DT).collect();
    if angles.len() < LEAST_AT_REST {
        return String::new();
    }
    let mean = angles.iter().sum::<f64>() / angles.len() as f64;
    let variance = angles.iter().map(|angle| (angle - mean).powi(2)).sum::<f64>() / angles.len() as f64;
    format!(
        "; at rest it scatters by {:.6} rad in 1 s, so smaller errors cannot be measured",
        variance.sqrt()
    )
}

fn of_course(gyro: &align::Rate, course: &align::Rate) -> Finding {
    let change = |pair: &[(f64, f64)]| {
        let seconds = pair[1].0 - pair[0].0;
        let turn = (pair[1].1 - pair[0].1 + PI).rem_euclid(TAU) - PI;
        (seconds < COURSE_GAP).then(|| (0.5 * (pair[0].0 + pair[1].0), turn / seconds))
    };
    let change: Vec<(f64, f64)> = course.windows(2).filter_map(change).collect();
    let values = format!("A course, {} values", course.len());
    match align::offset(gyro, &change) {
        Ok(Offset { seconds, coefficient }) => Finding {
            what: WHAT,
            verdict: if seconds.abs() < LATE.1 { Verdict::Good } else { Verdict::Note },
            text: format!(
                "{values}; its change agrees with the gyro (correlation {coefficient:.3}), {}.",
                delay(seconds)
            ),
        },
        Err(reason) => Finding::note(WHAT, format!("{values}; cannot be aligned with the gyro: {reason}.")),
    }
}
