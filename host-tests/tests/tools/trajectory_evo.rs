//! The trajectory error against evo itself, the program that the paper used. Skipped, aloud,
//! where `GYRONET_PYTHON` (or `python3`) has no evo.

use gyronet::odometry::Track;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::require;
use gyronet_tools::evaluate::trajectory_error::{Point, TrajectoryError};
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

const PACKAGES: &[&str] = &["evo", "numpy"];

/// Rmse and mean, as they lie and aligned.
fn evo(python: &str, estimate: &[Point], truth: &[Point]) -> [f64; 4] {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/clients/ape.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python runs");
    let mut rows = String::new();
    for (e, t) in estimate.iter().zip(truth) {
        writeln!(rows, "{:?} {:?} {:?} {:?}", e[0], e[1], t[0], t[1]).expect("text");
    }
    child.stdin.take().expect("piped").write_all(rows.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).expect("text");
    let values: Vec<f64> = text.split_whitespace().map(|word| word.parse().expect("a number")).collect();
    values.try_into().expect("four of them")
}

/// A drive of ten minutes, and what dead reckoning with a bad gyro makes of it.
fn paths(seed: u64) -> (Vec<Point>, Vec<Point>) {
    let mut noise = Noise::new(seed);
    let (mut good, mut bad, mut rate) = (Track::default(), Track::default(), 0.0);
    (0..6_000)
        .map(|_| {
            rate = 0.98 * rate + 0.02 * noise.normal();
            good.step([1.0; 2], 0.1 * rate);
            bad.step([1.01; 2], 0.1 * rate + 1e-5 + 1e-5 * noise.normal());
            (bad.position, good.position)
        })
        .unzip()
}

#[test]
fn equal_to_evo() {
    let Some(python) = require::python("equal_to_evo", PACKAGES) else { return };
    for seed in 0..3 {
        let (estimate, truth) = paths(seed);
        let theirs = evo(&python, &estimate, &truth);
        let raw = TrajectoryError::new(&estimate, &truth).expect("points");
        let aligned = TrajectoryError::aligned(&estimate, &truth).expect("points");
        let ours = [raw.rmse_m, raw.mean_m, aligned.rmse_m, aligned.mean_m];
        println!("{ours:?}");
        assert!(ours[0] > 2.0 * ours[2], "there is something to align");
        for (ours, theirs) in ours.into_iter().zip(theirs) {
            assert!((ours - theirs).abs() < 1e-9, "{ours} {theirs}");
        }
    }
}
