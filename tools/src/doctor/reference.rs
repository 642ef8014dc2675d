//! Examines the reference, a true yaw rate or a course.

use super::align::{self, Offset};
use super::finding::{Finding, Verdict};
use super::line::{DEGREES, Line, confused, seconds, turned};
use super::recording::{Rows, SECOND};
use super::remedy;
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
/// Seconds by which GPS time is ahead of UTC.
const GPS_AHEAD: f64 = 18.0;
/// Gain error that is worth a word, and gains beyond which a unit is wrong.
const GAIN: f64 = 0.003;
/// A reference that never turns faster has nothing to compare, rad/s.
const STILL: f64 = 0.01;
/// A mean rate of a second that is no gyro's bias, deg/s.
const NO_BIAS_DEG: f64 = 6.0;
const FAR: Range<f64> = 0.8..1.25;

pub fn finding(rows: &Rows, standstill: Option<&Range<usize>>) -> Finding {
    let known = rows.reference.iter().flatten().count();
    let courses = rows.course.iter().flatten().count();
    if known > 0 {
        let percent = 100.0 * known as f64 / rows.len() as f64;
        let noise = standstill.map(|span| scatter(&rows.reference[span.clone()])).unwrap_or_default();
        of_rate(rows, &format!("A yaw rate in {percent:.0} % of the rows"), &noise)
    } else if courses > 0 {
        of_course(rows, &format!("A course, {courses} values"))
    } else {
        Finding::note(
            WHAT,
            "None: no method can be judged and no network trained. Record a GNSS position, or a better gyro.",
        )
    }
}

/// The clock of a reference against the gyro's; its sign may be the other one.
fn aligned(gyro: &align::Rate, other: &[(f64, f64)]) -> Result<Offset, (String, bool)> {
    let negative: Vec<(f64, f64)> = other.iter().map(|(time, rate)| (*time, -rate)).collect();
    align::offset(gyro, other).map_err(|reason| (reason, align::offset(gyro, &negative).is_ok()))
}

/// The largest mean rate of a second, without the sign, rad/s.
fn turns(rate: &align::Rate) -> f64 {
    let mean = |second: &[(f64, f64)]| second.iter().map(|(_, rate)| rate).sum::<f64>() / second.len() as f64;
    rate.chunks(SECOND).map(|second| mean(second).abs()).fold(0.0, f64::max)
}

/// The words on a wrong sign, or on another reason for which a reference does not fit.
fn unfit(values: &str, (reason, mirrored): (String, bool)) -> Finding {
    let reason =
        if mirrored { "the opposite sign (turns to the left are positive, with z up)" } else { &reason };
    Finding::bad(WHAT, format!("{values} that does not fit the gyro: {reason}."))
}

/// A confusion of units, by how much more the gyro turns than the reference.
fn units(rows: &Rows, gain: f64, column: &str) -> Option<String> {
    let channel = if confused(gain, DEGREES) {
        remedy::channel(rows, "imu", "imu")
    } else if confused(gain, 1.0 / DEGREES) {
        remedy::channel(rows, "reference_rate", column)
    } else {
        return None;
    };
    Some(format!("the gyro turns {gain:.3} times as much: {}", remedy::unit(rows, channel, "deg/s")))
}

fn of_rate(rows: &Rows, values: &str, noise: &str) -> Finding {
    let (gyro, rate) = (rows.series(|k| Some(rows.rate[k][2])), rows.series(|k| rows.reference[k]));
    let Offset { seconds: late, coefficient } = match aligned(&gyro, &rate) {
        Ok(offset) => offset,
        Err(_) if turns(&rate) < STILL => {
            let text = format!("{values}{noise}; it shows no turn");
            return match turns(&gyro).to_degrees() {
                deg if deg > NO_BIAS_DEG => {
                    Finding::bad(WHAT, format!("{text}, and the gyro turns by {deg:.0} deg/s."))
                }
                _ => Finding::note(WHAT, text + "."),
            };
        }
        Err(reason) => return unfit(values, reason),
    };
    let shift = (late / DT).round() as isize;
    let pair = |k: usize| Some((rows.rate.get(k.checked_add_signed(shift)?)?[2], rows.reference[k]?));
    let line = Line::of(&seconds(rows, 5, pair));
    let gain = line.map_or(1.0, |line| 1.0 / line.slope);
    let text = format!("{values}, correlation with the gyro {coefficient:.4}, {}{noise}", delay(late));
    if let Some(units) = units(rows, gain, "ref_gyr_z") {
        return Finding::bad(WHAT, format!("{text}; {units}."));
    }
    if !FAR.contains(&gain) {
        return Finding::bad(
            WHAT,
            format!("{text}; the gyro turns {gain:.3} times as much: one unit is wrong."),
        );
    }
    if late.abs() >= LATE.0 {
        let name = remedy::channel(rows, "reference_rate", "ref_gyr_z");
        let import = remedy::import(rows, &format!("--offset {name}={late:.3}"));
        return Finding::bad(WHAT, format!("{text}; {import}."));
    }
    let sigma = line.map_or(0.0, |line| line.sigma);
    let gain =
        if (gain - 1.0).abs() < GAIN.max(3.0 * sigma) { String::new() } else { percent("gain", gain, sigma) };
    Finding::good(WHAT, format!("{text}{gain}."))
}

/// "; the gyro's gain is 0.7 +- 0.1 % too high"
fn percent(what: &str, ratio: f64, sigma: f64) -> String {
    let word = if ratio > 1.0 { "high" } else { "low" };
    format!("; the gyro's {what} is {:.1} +- {:.1} % too {word}", 100.0 * (ratio - 1.0).abs(), 100.0 * sigma)
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

fn of_course(rows: &Rows, values: &str) -> Finding {
    let known: Vec<(usize, f64)> = (0..rows.len()).filter_map(|row| Some((row, rows.course[row]?))).collect();
    // Two courses: their rows, and the turn between them, rad.
    let turns = known.windows(2).filter_map(|pair| {
        let ((from, before), (to, after)) = (pair[0], pair[1]);
        let turn = (after - before + PI).rem_euclid(TAU) - PI;
        (rows.seconds[to] - rows.seconds[from] < COURSE_GAP).then_some((from, to, turn))
    });
    let turns: Vec<(usize, usize, f64)> = turns.collect();
    let change = |(from, to, turn): &(usize, usize, f64)| {
        let (begin, end) = (rows.seconds[*from], rows.seconds[*to]);
        (0.5 * (begin + end), turn / (end - begin))
    };
    let gyro = rows.series(|k| Some(rows.rate[k][2]));
    let Offset { seconds: late, coefficient } =
        match aligned(&gyro, &turns.iter().map(change).collect::<Vec<_>>()) {
            Ok(offset) => offset,
            Err((_, true)) => return unfit(values, (String::new(), true)),
            Err((reason, false)) => {
                return Finding::note(WHAT, format!("{values}; cannot be aligned with the gyro: {reason}."));
            }
        };
    let (angle, shift) = (turned(rows), (late / DT).round() as isize);
    let pair = |(from, to, turn): &(usize, usize, f64)| {
        let at = |row: usize| angle.get(row.checked_add_signed(shift)?);
        Some((at(*to)? - at(*from)?, *turn))
    };
    let line = Line::of(&turns.iter().filter_map(pair).collect::<Vec<_>>());
    let gain = line.map_or(1.0, |line| 1.0 / line.slope);
    let text =
        format!("{values}; its change agrees with the gyro (correlation {coefficient:.3}), {}", delay(late));
    if let Some(units) = units(rows, gain, "ref_yaw") {
        return Finding::bad(WHAT, format!("{text}; {units}."));
    }
    if late.abs() >= LATE.1 {
        let gps = if (late.abs() - GPS_AHEAD).abs() < 1.0 { " (GPS time against UTC)" } else { "" };
        let name = remedy::channel(rows, "position", "position");
        let import = remedy::import(rows, &format!("--offset {name}={late:.1}"));
        return Finding::bad(WHAT, format!("{text}{gps}; {import}."));
    }
    // A course slips in bends, so it says less of a gain than a rate does.
    let gain = if (0.9..1.1).contains(&gain) {
        String::new()
    } else {
        percent("scale", gain, line.map_or(0.0, |line| line.sigma))
    };
    Finding {
        what: WHAT,
        verdict: if gain.is_empty() { Verdict::Good } else { Verdict::Note },
        text: format!("{text}{gain}."),
    }
}
