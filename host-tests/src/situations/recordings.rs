//! Recordings with a reference, judged as the situations are, with the reference's own error.

use super::board::Board;
use super::judge::{Outcome, Reference, judge};
use super::receiver::{INERTIAL, Receiver};
use super::ride::Travelled;
use super::sensor::mti;
use super::vehicle::{Part, STEP};
use crate::recordings::drives;
use gyronet::store::Learned;
use gyronet::units::Micros;
use gyronet_tools::drive::stream::Recording;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// The references' errors by folder, from the notes of their recordings: a gyro with its noise in a second and its bias,
/// a ring laser, the course of an antenna that swings in turns, an inertial system of the same unit, courses of GNSS and RTK.
const REFERENCES: [(&str, Reference); 6] = [
    ("wid_car", Reference { noise: 1e-4, drift: 1.7e-4, timing: 0.01 }),
    ("truck", Reference { noise: 3e-5, drift: 1e-5, timing: 0.01 }),
    ("car_mti710", Reference { noise: 0.02, drift: 0.0, timing: 0.05 }),
    ("utv", Reference { noise: 0.01, drift: 0.0, timing: 0.05 }),
    ("rc_car", Reference { noise: 0.02, drift: 0.0, timing: 0.05 }),
    ("real_car", Reference { noise: 0.05, drift: 0.0, timing: 0.5 }),
];
/// Longest time between two courses, s.
const LONGEST: f64 = 1.5;

/// Every recording below a folder that has a reference and this in its name, with its outcome.
pub fn judged(folder: &Path, wanted: &str) -> Vec<(String, Outcome)> {
    let mut judged = Vec::new();
    for (name, reference) in REFERENCES {
        for path in drives(&folder.join(name)) {
            let title = format!("{name}/{}", path.file_stem().unwrap_or_default().display());
            if title.contains(wanted) {
                let recording = Recording::read(&path).unwrap_or_else(|error| panic!("{error}"));
                judged.extend(run(&recording, &reference).map(|outcome| (title, outcome)));
            }
        }
    }
    judged
}

/// Sends a recording through the board as an MTi and wheel frames; `None` without a reference.
fn run(recording: &Recording, reference: &Reference) -> Option<Outcome> {
    let truth = truth(recording)?;
    let first = recording.rows.first()?.sample.time.0;
    let mut frames = recording.wheels();
    let mut board = Board::new(Part::Xsens, frames.is_some(), 10, &Learned::NOTHING);
    let mut received = Receiver::new(INERTIAL);
    let mut rows = recording.rows.iter().zip(0..).peekable();
    for step in 1..=(truth.seconds() / STEP) as usize {
        let now = step as f64 * STEP;
        let clock = Micros((now * 1e6).round() as u64);
        while let Some((row, number)) = rows.next_if(|(row, _)| row.sample.time.0 - first <= clock.0) {
            let [a, b, c] = row.sample.angular_rate.map(|rate| rate.rad_per_sec());
            let [d, e, f] = row.sample.specific_force.map(|force| force.metre_per_sec2());
            let ticks = ((row.sample.time.0 - first) / 100) as u32;
            board.receive(&mti(number, ticks, [a, b, c, d, e, f], 25.0, None));
            if let Some(frame) = frames.as_mut().and_then(|frames| frames.next(row)) {
                board.receive_frame(frame);
            }
        }
        board.step(clock).iter().for_each(|frame| received.take(frame, now));
    }
    let outcome = judge(&received, &truth, truth.seconds(), reference);
    Some(Outcome { seconds: truth.seconds() as usize, ..outcome })
}

/// The reference's heading: the sum of its rate, or its course without wraps.
fn truth(recording: &Recording) -> Option<Travelled> {
    let first = recording.rows.first()?.sample.time.0;
    let (mut heading, mut before, mut points) = (0.0, 0.0, Vec::new());
    for row in &recording.rows {
        let time = (row.sample.time.0 - first) as f64 * 1e-6;
        if let Some(rate) = row.reference {
            heading += rate * (time - points.last().map_or(time, |(last, _)| *last));
        } else if let Some(course) = row.course {
            heading += (course - before + PI).rem_euclid(TAU) - PI;
            before = course;
        } else {
            continue;
        }
        points.push((time, heading));
    }
    if recording.rows.iter().all(|row| row.reference.is_none()) {
        points = smoothed(&points);
    }
    (points.len() > 100).then(|| Travelled::recorded(&points, LONGEST))
}

/// The medians of five courses each: single ones are off by several sigma.
fn smoothed(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let middle = |five: &[(f64, f64)]| {
        let mut headings = [five[0].1, five[1].1, five[2].1, five[3].1, five[4].1];
        headings.sort_by(f64::total_cmp);
        (five[2].0, headings[2])
    };
    points.windows(5).map(middle).collect()
}
