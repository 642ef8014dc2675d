//! Detectors of standstill without wheels, each with the limit that claims at most half a second of motion on any training
//! drive: what they find there, and what they claim and find on all recordings with a speed.
//!
//! Windows of 2 s, ten a second: moving variance, angular rate energy and SHOE of raw samples (Skog, Handel, Nilsson and
//! Rantakokko, IEEE Trans. Biomed. Eng. 57, 2010), and the one in use, without its condition of braking.

use crate::standstill_truth::{Truth, read};
use gyronet::standstill::{Inertial, SPEED_CHANGE};
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::drive::recording::Row;
use gyronet_tools::drive::stream::Recording;

const WINDOW: usize = 200;
const STEP: usize = 10;
/// Steps of motion that a limit may claim on a training drive: half a second.
const CLAIMED: usize = 5;
/// Steps of a stop that count as finding it: a second.
const FOUND: usize = 10;
const NAMES: [&str; 5] = [
    "moving variance of the force",
    "angular rate energy",
    "SHOE",
    "variance of 100 ms means",
    "the one in use",
];
/// Noise of SHOE's readings, m/s^2 and rad/s.
const NOISE: [f64; 2] = [0.05, 0.002];

type Axes = [f64; 3];

fn square(axes: Axes) -> f64 {
    axes.iter().map(|axis| axis * axis).sum()
}

fn less(one: Axes, other: Axes) -> Axes {
    std::array::from_fn(|axis| one[axis] - other[axis])
}

fn mean(rows: &[Row], value: impl Fn(&Row) -> Axes) -> Axes {
    let sum = rows.iter().map(value).fold([0.0; 3], |sum, value| std::array::from_fn(|k| sum[k] + value[k]));
    sum.map(|sum| sum / rows.len() as f64)
}

fn force(row: &Row) -> Axes {
    row.sample.specific_force.map(|force| force.metre_per_sec2())
}

fn rate(row: &Row) -> Axes {
    row.sample.angular_rate.map(|rate| rate.rad_per_sec())
}

/// The statistics of the window that ends at each step, and its last row.
fn statistics(recording: &Recording) -> Vec<(usize, [f64; 5])> {
    let rows = &recording.rows;
    let bias = mean(&rows[..rows.len().min(300)], rate);
    let (mut inertial, mut newest, mut steps) = (Inertial::START, None, Vec::new());
    for (row, at) in rows.iter().enumerate() {
        newest = inertial.add(&at.sample).or(newest);
        if (row + 1) % STEP != 0 || row + 1 < WINDOW {
            continue;
        }
        let window = &rows[row + 1 - WINDOW..=row];
        let (own, gravity) = (mean(window, force), square(mean(window, force)).sqrt());
        let share = |value: &dyn Fn(&Row) -> f64| window.iter().map(value).sum::<f64>() / WINDOW as f64;
        let upright = own.map(|axis| axis * 9.806_65 / gravity);
        let energy = share(&|row| square(less(rate(row), bias)));
        let tilted = share(&|row| square(less(force(row), upright)));
        let shoe = tilted / NOISE[0].powi(2) + energy / NOISE[1].powi(2);
        let motion = newest.map_or([f64::MAX; 2], |motion| {
            let limit = f64::from(SPEED_CHANGE);
            let shake = f64::from(motion.shake);
            [shake, if f64::from(motion.speed_change) < limit { shake } else { f64::MAX }]
        });
        let variance = share(&|row| square(less(force(row), own)));
        steps.push((row, [variance, energy, shoe, motion[0], motion[1]]));
    }
    steps
}

#[test]
fn detectors_without_wheels_beside_each_other() {
    let Some(paths) = recordings::with_speed() else { return };
    let drives: Vec<_> = parallel::map(&paths, |path| {
        let recording = read(path);
        let is_training =
            ["02", "03", "04", "06", "07"].iter().any(|k| recording.name().contains(&format!("trial{k}")));
        Truth::read(path, &recording).map(|truth| (is_training, truth, statistics(&recording)))
    })
    .into_iter()
    .flatten()
    .collect();
    println!(
        "{:<30} {:>12} {:>22} {:>22}",
        "detector", "limit", "training: s, stops", "all: s, worst, stops"
    );
    let mut in_use = [0; 5];
    for (k, name) in NAMES.iter().enumerate() {
        let of_training = drives.iter().filter(|(is_training, ..)| *is_training);
        let limits = of_training.map(|(_, truth, steps)| {
            let moving = steps.iter().filter(|(row, _)| truth.moves[*row]);
            let mut values: Vec<f64> = moving.map(|(_, statistics)| statistics[k]).collect();
            values.sort_by(f64::total_cmp);
            values.get(CLAIMED).copied().unwrap_or(f64::MAX)
        });
        let limit = limits.fold(f64::MAX, f64::min);
        let count = |training: bool| {
            let (mut claimed, mut worst, mut found, mut all) = (0, 0, 0, 0);
            for (_, truth, steps) in drives.iter().filter(|(is_training, ..)| *is_training || !training) {
                let claims: Vec<usize> =
                    steps.iter().filter(|(_, values)| values[k] < limit).map(|(row, _)| *row).collect();
                let moving = claims.iter().filter(|row| truth.moves[**row]).count();
                (claimed, worst) = (claimed + moving, worst.max(moving));
                for stop in truth.stops() {
                    all += 1;
                    found += usize::from(claims.iter().filter(|row| stop.contains(row)).count() >= FOUND);
                }
            }
            (claimed as f64 / 10.0, worst as f64 / 10.0, found, all)
        };
        let [(claimed, _, found, stops), (of_all, worst, found_of_all, all)] = [true, false].map(count);
        in_use[k] = found;
        println!(
            "{name:<30} {limit:>12.3e} {claimed:>10.1} s, {found:>2} of {stops} {of_all:>8.1} s, {worst:>5.1} s, {found_of_all:>2} of {all}"
        );
    }
    let [simpler @ .., _, own] = in_use;
    assert!(simpler.iter().all(|found| *found <= own), "the simplest that no other beats: {in_use:?}");
}
