//! The mounting of the board in the vehicle must not show in the yaw rate.

use gyronet::bias::StaticError;
use gyronet::mounting::{LevelError, Rotation};
use gyronet::pipeline::PipelineConfig;
use gyronet::units::SpecificForce;
use gyronet_host_tests::noise::cases;
use gyronet_host_tests::synthetic::{force, rate, turning};
use gyronet_host_tests::{models, recordings, stream};
use gyronet_tools::bundled;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::stream::Recording;
use proptest::prelude::*;

/// The angle by which the sensor is turned, about x, then about y, deg.
const TURNED: f32 = 30.0;

/// The readings of a sensor that is turned by 30 degrees about x and y on the same drive: the inverse
/// of its mounting, as the transpose of a rotation is.
fn turned(recording: &Recording) -> Recording {
    let (sin, cos) = f64::from(TURNED).to_radians().sin_cos();
    let turn = |[x, y, z]: [f64; 3]| {
        let [x, z] = [cos * x - sin * z, sin * x + cos * z];
        [x, cos * y + sin * z, cos * z - sin * y]
    };
    let mut recording = recording.clone();
    for row in &mut recording.rows {
        let code = |value: f64| value.round() as i32;
        let rates = turn(row.sample.angular_rate.map(|axis| f64::from(axis.0)));
        let forces = turn(row.sample.specific_force.map(|axis| f64::from(axis.0)));
        for axis in 0..3 {
            row.sample.angular_rate[axis].0 = code(rates[axis]);
            row.sample.specific_force[axis].0 = code(forces[axis]);
        }
    }
    recording
}

fn yaw_rates(recording: &Recording, mounting: Rotation, levelling: bool) -> Vec<f64> {
    let config = PipelineConfig { mounting, levelling, ..PipelineConfig::DEFAULT };
    let drive = Replay::run(recording, &config, recording.wheels(), &mut models::gyronet());
    drive.expect("it stands still first").delayed().map(|rate| rate.rate.rad_per_sec()).collect()
}

/// RMS of the difference, and the largest difference of the angle turned, rad.
fn apart(a: &[f64], b: &[f64]) -> (f64, f64) {
    assert_eq!(a.len(), b.len());
    let (mut squares, mut angle, mut largest) = (0.0, 0.0, 0.0f64);
    for (a, b) in a.iter().zip(b) {
        squares += (a - b) * (a - b);
        angle += (a - b) * 0.01;
        largest = largest.max(f64::abs(angle));
    }
    ((squares / a.len() as f64).sqrt(), largest)
}

/// `noise`: RMS error of the level drive's rate (0.0014 rad/s against the reference on trial 08); `street`: angle that
/// the slope of the parking place may cost, for levelling takes it for mounting.
fn check(recording: &Recording, noise: f64, street: f64) {
    let tilted = turned(recording);
    let level = yaw_rates(recording, Rotation::IDENTITY, true);
    let mounting = Rotation::from_mounting(TURNED, TURNED, 0.0).expect("finite");
    for (what, mounting, levelling, angle) in
        [("configured", mounting, true, 2e-4), ("levelled", Rotation::IDENTITY, true, street)]
    {
        let (rms, largest) = apart(&yaw_rates(&tilted, mounting, levelling), &level);
        println!("{}: {what}: {rms:.6} rad/s RMS apart, angle {largest:.5} rad", recording.name());
        assert!(rms <= noise, "{}: {what}: {rms} rad/s", recording.name());
        assert!(largest <= angle, "{}: {what}: {largest} rad", recording.name());
    }
    let (rms, largest) = apart(&yaw_rates(&tilted, Rotation::IDENTITY, false), &level);
    println!("{}: as it is: {rms:.6} rad/s RMS apart, angle {largest:.5} rad", recording.name());
    assert!(rms > noise, "the test can tell");
}

#[test]
fn a_sensor_turned_by_30_degrees_gives_the_same_yaw_on_the_simulated_drive() {
    check(&bundled::simulated_drive().expect("it comes with the tools"), 0.0014, 0.01);
}

#[test]
fn a_sensor_turned_by_30_degrees_gives_the_same_yaw_on_a_real_drive() {
    let Some(path) = recordings::trial(8) else { return };
    check(&Recording::read(&path).expect("a recording"), 0.0014, 0.01);
}

#[test]
fn what_shows_no_vertical_is_refused() {
    for (up, upside_down) in [(5.0, false), (-9.81, true)] {
        let mut pipeline = stream::new();
        let samples = (0..300).map(|tick| {
            let mut sample = turning(tick, rate(0.001));
            sample.specific_force[2] = force(up);
            sample
        });
        let outputs = stream::run(&mut pipeline, samples, stream::constant(0.0));
        let Some(StaticError::Level(error)) = outputs[299].refused else { panic!("{up} m/s^2 is refused") };
        assert_eq!(matches!(error, LevelError::UpsideDown(_)), upside_down, "{error}");
    }
}

proptest! {
    #![proptest_config(cases(500))]

    #[test]
    fn levelling_turns_the_vertical_up(roll in -100f32..100.0, pitch in -40f32..40.0) {
        let (sr, cr) = f64::from(roll).to_radians().sin_cos();
        let (sp, cp) = f64::from(pitch).to_radians().sin_cos();
        let rest = [-sp * 9.81, sr * cp * 9.81, cr * cp * 9.81].map(force);
        let (rotation, tilt) = Rotation::levelling(rest).expect("gravity");
        prop_assert!((f64::from(tilt) - (cr * cp).acos().to_degrees()).abs() < 0.02);
        let [x, y, z] = rotation.force(rest).map(SpecificForce::metre_per_sec2);
        prop_assert!(x.abs() < 1e-5 && y.abs() < 1e-5 && (z - 9.81).abs() < 1e-5, "{} {} {}", x, y, z);
    }

    #[test]
    fn a_rotation_keeps_lengths_and_one_after_another_is_one(
        angles in proptest::array::uniform3(-180f32..180.0), rates in proptest::array::uniform3(-3.0..3.0),
    ) {
        let [roll, pitch, yaw] = angles;
        let rates = rates.map(rate);
        let norm = |v: [gyronet::units::AngularRate; 3]| v.iter().map(|a| a.rad_per_sec().powi(2)).sum::<f64>().sqrt();
        let all = Rotation::from_mounting(roll, pitch, yaw).expect("finite");
        let turned = all.rate(rates);
        prop_assert!((norm(turned) - norm(rates)).abs() < 2e-6);
        let one = |r, p, y| Rotation::from_mounting(r, p, y).expect("finite");
        let stepwise = one(roll, 0.0, 0.0).then(&one(0.0, pitch, 0.0)).then(&one(0.0, 0.0, yaw));
        for (a, b) in turned.iter().zip(stepwise.rate(rates)) {
            prop_assert!((a.rad_per_sec() - b.rad_per_sec()).abs() < 2e-6);
        }
        prop_assert_eq!(Rotation::IDENTITY.rate(rates), rates);
    }
}
