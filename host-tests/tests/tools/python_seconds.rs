//! The trainer's Python and this library make the same of the same files: the seconds and the windows of FoGNet (Fig. 8),
//! its losses (Eq. 14 to 16), and the windows of GyroNet. Python needs numpy alone.

use crate::fognet_integer::rms;
use gyronet::model::fognet::{FogEstimate, MinuteNetwork};
use gyronet::model::seconds::{FRAMES, STEPS, Second, SecondsWindow};
use gyronet::units::{Angle, AngularRate, SpecificForce, WheelSpeed};
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require;
use gyronet_paper::fog_replay;
use gyronet_paper::sequence::{self, Sequence};
use gyronet_paper::simulate::{self, Spec};
use gyronet_tools::drive::stream::Recording;
use serde::Deserialize;
use std::fs::File;
use std::io::BufWriter;
use std::process::Command;

const FEATURES: usize = 9;
/// The windows are compared after so many seconds: padded ones, the first full one, a later one.
const ENDS: [usize; 4] = [1, 7, 60, 75];
/// The made-up correction and losses' settings.
const CORRECTION: f64 = 2e-4;
const SCALE: f64 = 3e-4;
const ALPHA: f64 = 0.5;

#[derive(Deserialize)]
struct FromPython {
    /// The windows that end as [`ENDS`] says, 60 seconds of nine features each.
    windows: Vec<Vec<[f64; FEATURES]>>,
    /// Eq. 14, 15 and 16 over these windows.
    losses: [f64; 3],
    /// GyroNet's first window after static initialisation.
    window: Vec<[f64; 6]>,
}

#[derive(Default)]
struct Windows(Vec<Vec<[f64; FEATURES]>>);

impl MinuteNetwork for Windows {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        let row = |second: &Second| -> [f64; FEATURES] {
            let [fx, fy, fz, wx, wy, wz, left, right] = second.features;
            let force = [fx, fy, fz].map(|code| SpecificForce(code).metre_per_sec2());
            let rate = [wx, wy, wz].map(|code| AngularRate(code).rad_per_sec());
            let way = [left, right].map(|code| f64::from(code) / f64::from(1 << WheelSpeed::FRACTION_BITS));
            [&force[..], &rate, &way, &[second.turn.rad()]].concat().try_into().expect("nine of them")
        };
        self.0.push(window.iter().map(row).collect());
        FogEstimate { correction: Angle::ZERO, linear: Angle::ZERO, gain: 0, clamped_inputs: 0 }
    }
}

#[test]
fn python_and_the_library_make_the_same_windows_and_losses() {
    let Some(python) = require::python(&["numpy"]) else { return };
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let spec = Spec { name: "made".into(), seconds: 90, device: 1, run: 4 };
    simulate::write(&spec, folder).unwrap();
    let sequence = Sequence::read(folder).unwrap();
    let csv = folder.join("made.csv");
    sequence::write_csv(&sequence, BufWriter::new(File::create(&csv).unwrap())).unwrap();
    let mut windows = Windows::default();
    fog_replay::run(&sequence, &mut windows);

    let script = workspace().join("host-tests/tests/clients/training_windows.py");
    let ends = ENDS.map(|end| end.to_string()).join(",");
    let settings = [CORRECTION, SCALE, ALPHA].map(|value| value.to_string());
    let output = Command::new(python)
        .env("PYTHONPATH", workspace().join("tools/python"))
        .args([&script, &csv])
        .arg(ends)
        .args(settings)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let python: FromPython = serde_json::from_slice(&output.stdout).unwrap();

    // The library counts a wheel's way and a rate in codes; the features of a second are means of these.
    let most = [1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-9];
    for (end, theirs) in ENDS.into_iter().zip(&python.windows) {
        compare(&windows.0[end - 1], theirs, most, end);
    }

    let turns = sequence.turns();
    let second = FRAMES as usize;
    let (mut first, mut other, mut count) = (0.0, 0.0, 0.0);
    let spread = rms(windows.0[*ENDS.last().unwrap() - 1].iter().map(|row| row[8]));
    for end in ENDS.into_iter().filter(|end| *end >= STEPS) {
        let steps = (end - STEPS) * second..end * second;
        let turned: f64 = sequence.steps[steps.clone()].iter().map(|step| step.fog).sum();
        let label = turned - turns[steps].iter().sum::<f64>();
        first += (CORRECTION - label).abs() / SCALE;
        other += windows.0[end - 1].iter().map(|row| (row[8] / spread).abs()).sum::<f64>() / STEPS as f64;
        count += 1.0;
    }
    let expected = [first / count, other / count, (first + ALPHA * other) / count];
    for (ours, theirs) in expected.into_iter().zip(python.losses) {
        assert!(ours > 0.01 && (ours - theirs).abs() < 1e-4 * ours, "{expected:?} {:?}", python.losses);
    }

    let recording = Recording::read(&csv).unwrap();
    let samples: Vec<[f64; 6]> = recording.rows.iter().take(310).map(|row| features(&row.sample)).collect();
    let mean = |axis: usize| samples[..300].iter().map(|row| row[axis]).sum::<f64>() / 300.0;
    let bias = [0.0, 0.0, 0.0, mean(3), mean(4), mean(5)];
    for (sample, theirs) in samples[300..].iter().zip(&python.window) {
        for ((ours, bias), theirs) in sample.iter().zip(bias).zip(theirs) {
            assert!((ours - bias - theirs).abs() < 1e-4, "{sample:?} {theirs}");
        }
    }
    assert_eq!(python.window.len(), 10);
}

fn features(sample: &gyronet::sample::ImuSample) -> [f64; 6] {
    let [fx, fy, fz] = sample.specific_force.map(SpecificForce::metre_per_sec2);
    let [wx, wy, wz] = sample.angular_rate.map(AngularRate::rad_per_sec);
    [fx, fy, fz, wx, wy, wz]
}

fn compare(ours: &[[f64; FEATURES]], theirs: &[[f64; FEATURES]], most: [f64; FEATURES], end: usize) {
    assert_eq!((ours.len(), theirs.len()), (STEPS, STEPS));
    for (row, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        for (column, most) in most.into_iter().enumerate() {
            let off = (ours[column] - theirs[column]).abs();
            assert!(off <= most, "window {end}, row {row}, feature {column}: {ours:?} {theirs:?}");
        }
    }
}
