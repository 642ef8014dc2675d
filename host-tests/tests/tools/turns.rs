//! A turn is no gyro error: with a yaw rate added to a window, and the lateral acceleration that
//! goes with it, the integer network's correction stays where it was. Weights trained on the
//! drives alone failed here: a turn faster than theirs was taken for an error and marked good.

use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{GyroNet, WindowNetwork};
use gyronet::pipeline::{BoardState, Pipeline, PipelineConfig};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::{models, recordings};
use gyronet_tools::bundled;
use gyronet_tools::drive::stream::Recording;

/// Yaw rates added, rad/s: up to 57 deg/s, more than a car turns at.
const YAW_RATES: [f32; 10] = [-1.0, -0.7, -0.5, -0.3, -0.1, 0.1, 0.3, 0.5, 0.7, 1.0];
/// Lateral acceleration is yaw rate times speed, up to what tyres hold.
const SPEED: f32 = 8.0;
const LATERAL_MAX: f32 = 4.0;
/// Features of a window's sample.
const LATERAL: usize = 1;
const YAW_RATE: usize = 5;
/// Largest change of the mean correction, rad/s: 1 % of a turn of 0.1 rad/s.
const LARGEST: f64 = 0.001;

/// Every twentieth one of the pipeline.
fn windows(recording: &Recording) -> Vec<[Features; WINDOW]> {
    let mut pipeline = Pipeline::new(PipelineConfig::DEFAULT);
    let outputs =
        recording.rows.iter().filter_map(|row| pipeline.correct(row.sample, None, &BoardState::GOOD).ok());
    outputs.filter_map(|output| output.window).map(|due| due.features).step_by(20).collect()
}

/// The mean correction over all windows with a turn added, rad/s.
fn mean_correction(network: &mut GyroNet<'_>, windows: &[[Features; WINDOW]], yaw_rate: f32) -> f64 {
    let rate = AngularRate::from_rad_per_sec(yaw_rate).expect("in range").0;
    let lateral = (yaw_rate * SPEED).clamp(-LATERAL_MAX, LATERAL_MAX);
    let lateral = SpecificForce::from_metre_per_sec2(lateral).expect("in range").0;
    let mut sum = 0.0;
    for window in windows {
        let mut turned = *window;
        for features in &mut turned {
            features[YAW_RATE] += rate;
            features[LATERAL] += lateral;
        }
        sum += network.estimate(&turned).corrections.iter().map(|c| c.rad_per_sec()).sum::<f64>();
    }
    sum / (windows.len() * WINDOW) as f64
}

fn check(recording: &Recording) {
    let mut network = models::gyronet();
    let windows = windows(recording);
    assert!(windows.len() > 50, "{} windows", windows.len());
    let straight = mean_correction(&mut network, &windows, 0.0);
    for yaw_rate in YAW_RATES {
        let change = mean_correction(&mut network, &windows, yaw_rate) - straight;
        println!("{}: {yaw_rate:+.1} rad/s changes the correction by {change:+.5} rad/s", recording.name());
        assert!(change.abs() <= LARGEST, "{}: {yaw_rate} rad/s: {change}", recording.name());
    }
}

#[test]
fn a_turn_is_no_error_on_the_simulated_drive() {
    check(&bundled::simulated_drive().expect("it comes with the tools"));
}

#[test]
fn a_turn_is_no_error_on_a_real_drive() {
    let Some(path) = recordings::trial(8) else { return };
    check(&Recording::read(&path).expect("a recording"));
}
