//! Reports what a recording can and cannot judge, by its turns, stops and length.

use super::finding::Finding;
use super::recording::{Rows, SECOND};
use crate::calibrate::{LEAST_TURNED_RAD, STRAIGHT_RAD};
use crate::drive::DT;
use gyronet::bias::STATIC_SAMPLES;
use std::ops::Range;

/// Least angle that counts as a turn, rad.
const TURN: f64 = std::f64::consts::FRAC_PI_4;
/// Seconds from which the drift shows.
const NEEDED_S: f64 = 300.0;

pub fn finding(rows: &Rows, standstills: &[Range<usize>]) -> Finding {
    let bias = standstills.first().map_or(0.0, |span| rows.mean_yaw_rate(span.clone()));
    let (turns, turned) = turns(rows, bias);
    let seconds = rows.seconds.last().copied().unwrap_or_default();
    let stops = standstills.iter().filter(|span| span.start >= STATIC_SAMPLES as usize).count();
    let lacks = [
        (turned < LEAST_TURNED_RAD, "gain (few turns)"),
        (stops == 0, "zero-rate updates (no later stop)"),
        (seconds < NEEDED_S, "drift over minutes (recording too short)"),
        (rows.reference.iter().all(Option::is_none), "errors of 1 s and 10 s (no reference rate)"),
    ];
    let lacks: Vec<&str> = lacks.into_iter().filter(|(lacks, _)| *lacks).map(|(_, what)| what).collect();
    let mut lacks = if lacks.is_empty() { "nothing".to_owned() } else { lacks.join(", ") };
    if turned >= LEAST_TURNED_RAD {
        lacks += ". Whether its turns show the gain, `gyronet calibrate` says";
    }
    Finding::note(
        "what it can judge",
        format!(
            "Turns of more than 45 deg: {turns}; turned in all: {turned:.1} rad; later stops: {stops}; length: {seconds:.0} s. It cannot judge: {lacks}."
        ),
    )
}

/// Returns the number of turns and the sum of all angles, rad. A turn ends in a straight second or where it changes sides.
fn turns(rows: &Rows, bias: f64) -> (usize, f64) {
    let (mut turned, mut turns, mut angle, mut last) = (0.0, 0, 0.0f64, 0.0f64);
    for second in rows.rate.chunks(SECOND) {
        let step = second.iter().map(|rate| rate[2] - bias).sum::<f64>() * DT;
        // The noise of a gyro at rest is not a turn.
        turned += if step.abs() < STRAIGHT_RAD { 0.0 } else { step.abs() };
        if step.abs() < STRAIGHT_RAD || step * last < 0.0 {
            turns += usize::from(angle.abs() > TURN);
            angle = 0.0;
        }
        angle += step;
        last = step;
    }
    (turns + usize::from(angle.abs() > TURN), turned)
}
