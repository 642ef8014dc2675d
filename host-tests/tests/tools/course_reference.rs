//! Drives whose reference is a course: a made-up one with a known heading error, one that starts moving, and references
//! that cannot be used.

use gyronet_tools::board::Uncorrected;
use gyronet_tools::drive::error::DataError;
use gyronet_tools::drive::stream::{Drive, Recording};
use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::rates::{Networks, Rates, Sample};
use gyronet_tools::evaluate::report::DriveErrors;
use std::fmt::Write;

/// Two minutes, rows.
const ROWS: usize = 13_000;
/// The gyro's bias, rad/s.
const BIAS: f64 = 0.002;
/// The gyro's error after 10 s, rad/s.
const DRIFT: f64 = 0.001;

/// The true yaw rate: still for `still` rows, then turns to the left and to the right.
fn yaw_rate(k: usize, still: usize) -> f64 {
    if k < still { 0.0 } else { 0.3 * (0.01 * (k - still) as f64).sin() + 0.1 }
}

/// A drive with the course of every tenth row from 6 s on, times `sign`, under the name `column`.
fn drive(still: usize, sign: f64, column: &str) -> Recording {
    let mut text = format!("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,{column}\n");
    let mut yaw = 1.0;
    for k in 0..ROWS {
        // Every axis flickers as a sensor does, with mean zero over three rows: equal readings are stuck ones.
        let noise = 1e-3 * ((k % 3) as f64 - 1.0);
        let off = BIAS + if k < 1_000 { 0.0 } else { DRIFT };
        yaw += 0.01 * yaw_rate(k, still);
        let course = if k >= 600 && k % 10 == 0 { format!("{:.6}", sign * yaw) } else { String::new() };
        let gyro = yaw_rate(k, still) + off + noise;
        let (time, up) = (0.01 * k as f64, 9.8 + 10.0 * noise);
        writeln!(text, "{time:.2},{noise},{noise},{up},{noise},{noise},{gyro},{course}").expect("a string");
    }
    Recording::parse("made/up.csv", text.as_bytes()).expect("a drive")
}

fn run(recording: &Recording, visit: impl FnMut(&Sample)) -> Result<DriveErrors, DataError> {
    let mut default = Uncorrected;
    let networks = Networks { default: &mut default, sent: None, paper: None };
    DriveErrors::of(&Drive::from(recording), networks, visit)
}

fn errors(recording: &Recording) -> Result<DriveErrors, DataError> {
    run(recording, |_| {})
}

#[test]
fn a_known_heading_error_is_found() {
    let errors = errors(&drive(500, 1.0, "ref_yaw")).expect("enough course");
    assert_eq!((errors.reference, errors.set.as_str(), errors.simulated_rest), ("ref_yaw", "made", false));
    let error = errors.methods[Method::STATIC].error;
    assert_eq!(error.mean_1s_rad, None);
    let near = |figure: Option<f64>, due: f64| {
        let figure = figure.expect("a figure");
        assert!((figure - due).abs() < 2e-3, "{figure} is not {due}");
    };
    near(error.mean_60s_rad, 60.0 * DRIFT);
    // From the middle of the first 20 s of course, 16 s, to that of the last 10 s of the drive.
    near(error.final_rad, DRIFT * (126.5 - 16.0));
    assert!(errors.methods[Method::RAW].error.final_rad.expect("a figure") > 0.3, "it keeps its bias");
}

/// The best constant bias is the mean of both, and the error is that of a bend, not of a bias.
#[test]
fn a_drive_that_starts_moving_gets_a_simulated_standstill() {
    let recording = drive(0, 1.0, "ref_yaw");
    let errors = errors(&recording).expect("enough course");
    assert!(errors.simulated_rest);
    let error = errors.methods[Method::STATIC].error.rms_rad.expect("a figure");
    assert!(error < 0.01, "{error}");
    assert!(errors.methods[Method::RAW].error.rms_rad.expect("a figure") > 0.1);
    let mut rates = Rates::of(&Drive::from(&recording));
    run(&recording, |sample| rates.add(sample)).expect("enough course");
    let seconds = rates.seconds;
    assert!((seconds[0] - 3.0).abs() < 1e-9 && seconds.len() + 10 > ROWS, "{}", seconds.len());
}

/// The gyro shows a rest, which the wheels deny.
#[test]
fn a_drive_whose_wheels_turn_at_the_start_gets_one_too() {
    let mut recording = drive(500, 1.0, "ref_yaw");
    assert!(!errors(&recording).expect("enough course").simulated_rest);
    recording.rows.iter_mut().for_each(|row| row.wheels = [Some(20.0); 4]);
    assert!(errors(&recording).expect("enough course").simulated_rest);
    recording.rows.iter_mut().for_each(|row| row.course = None);
    let error = errors(&recording).expect_err("nothing shows the bias").to_string();
    assert!(error.starts_with("made/up.csv: starts moving: line 2, wheel 1 turns at 20.00 rad/s"), "{error}");
}

#[test]
fn references_that_cannot_be_used_are_refused_with_the_reason() {
    let text = |recording: &Recording| errors(recording).expect_err("it cannot be used").to_string();
    let none = text(&drive(500, 1.0, "other"));
    assert!(none.starts_with("made/up.csv: line 302: no reference to evaluate against"), "{none}");
    let mirrored = text(&drive(500, -1.0, "ref_yaw"));
    assert!(mirrored.starts_with("made/up.csv: ref_yaw disagrees with the gyro by "), "{mirrored}");
    let mut short = drive(500, 1.0, "ref_yaw");
    short.rows.truncate(1_800);
    let short = text(&short);
    assert!(short.starts_with("made/up.csv: ref_yaw is known for too short a time"), "{short}");
}
