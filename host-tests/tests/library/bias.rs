//! Static initialisation: what counts as standing still, and the exact mean.

use gyronet::bias::{STATIC_SAMPLES, StaticConfig, StaticError, StaticInit};
use gyronet::sample::ImuSample;
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::synthetic::{force, idling, rate, turning};
use proptest::prelude::*;

type Verdict = Result<[AngularRate; 3], StaticError>;

/// Feeds exactly the samples of one initialisation; only the last may bring a verdict.
fn judge(init: &mut StaticInit, sample: impl FnMut(u64) -> ImuSample) -> Verdict {
    let mut verdicts =
        (0..u64::from(STATIC_SAMPLES)).map(sample).map(|sample| init.add(&sample, false, false));
    let last = verdicts.by_ref().enumerate().find_map(|(k, verdict)| Some((k, verdict?)));
    let (at, verdict) = last.expect("a verdict");
    assert_eq!(at as u32 + 1, STATIC_SAMPLES);
    verdict.map(|rest| rest.angular_rate)
}

fn judge_new(sample: impl FnMut(u64) -> ImuSample) -> Verdict {
    judge(&mut StaticInit::new(StaticConfig::DEFAULT), sample)
}

/// An idling vehicle with something added to one channel (0-2 gyro, 3-5 accelerometer).
fn idling_with(channel: usize, added: impl Fn(f64) -> f64) -> Verdict {
    let mut noise = Noise::new(5);
    judge_new(|tick| {
        let mut sample = idling(tick, 0.002, &mut noise);
        let value = added(tick as f64 / 100.0);
        match channel {
            0..3 => sample.angular_rate[channel].0 += rate(value).0,
            _ => sample.specific_force[channel - 3].0 += force(value).0,
        }
        sample
    })
}

#[test]
fn an_engine_is_no_motion() {
    let bias = idling_with(0, |_| 0.0).expect("it stands");
    for axis in bias {
        // 0.02 rad/s of shake leaves less than 0.0005 rad/s in the mean of 300 samples.
        assert!((axis.rad_per_sec() - 0.002).abs() < 5e-4, "{axis:?}");
    }
}

#[test]
fn motion_is_refused() {
    for axis in 0..3u8 {
        let (gyro, accel) = (usize::from(axis), usize::from(axis) + 3);
        // Starts to turn, and brakes, within the three seconds.
        let turn = idling_with(gyro, |t| 0.02 * (t - 1.0).max(0.0));
        assert!(matches!(turn, Err(StaticError::GyroDrift { axis: a, .. }) if a == axis), "{turn:?}");
        let brake = idling_with(accel, |t| -0.3 * (t - 1.0).max(0.0));
        assert!(matches!(brake, Err(StaticError::AccelDrift { axis: a, .. }) if a == axis), "{brake:?}");
        // Is shaken, by hand or by the road.
        let shaken = idling_with(gyro, |t| 0.12 * (30.0 * t).sin());
        assert!(matches!(shaken, Err(StaticError::GyroNoise { axis: a, .. }) if a == axis), "{shaken:?}");
        let road = idling_with(accel, |t| 3.0 * (70.0 * t).sin());
        assert!(matches!(road, Err(StaticError::AccelNoise { axis: a, .. }) if a == axis), "{road:?}");
        // Turns steadily, by more than any bias.
        let steady = idling_with(gyro, |_| -0.1);
        assert!(matches!(steady, Err(StaticError::GyroBias { axis: a, mean }) if a == axis && mean < -0.09));
    }
}

/// Whoever boards a vehicle, and the wind, rocks it and does not turn it.
#[test]
fn a_calm_vehicle_may_be_rocked_and_not_turned() {
    let rocked = 1.5 * f64::from(StaticConfig::DEFAULT.gyro_drift);
    for (axis, is_calm, is_taken) in [(0, false, false), (0, true, true), (1, true, true), (2, true, false)] {
        let mut init = StaticInit::new(StaticConfig::DEFAULT);
        let verdict = (0..u64::from(STATIC_SAMPLES)).find_map(|tick| {
            let mut sample = turning(tick, AngularRate(0));
            sample.angular_rate[axis] = rate(if tick < 100 { rocked } else { 0.0 });
            init.add(&sample, false, is_calm)
        });
        assert_eq!(verdict.expect("a verdict").is_ok(), is_taken, "axis {axis}, calm: {is_calm}");
    }
}

#[test]
fn numbers_in_a_refusal_are_right() {
    let Err(StaticError::GyroNoise { axis: 2, std }) =
        judge_new(|tick| turning(tick, rate(if tick % 2 == 0 { 0.08 } else { -0.06 })))
    else {
        panic!("a spread of 0.07 rad/s is no standing still")
    };
    assert!((std - 0.07).abs() < 1e-5, "{std}");
    let second = |tick| [0.001, 0.0, 0.0055][tick as usize / 100];
    let Err(StaticError::GyroDrift { axis: 2, spread }) = judge_new(|tick| turning(tick, rate(second(tick))))
    else {
        panic!("a spread of 0.0055 rad/s between seconds is no standing still")
    };
    assert!((spread - 0.0055).abs() < 1e-6, "{spread}");
}

#[test]
fn initialisation_starts_again_after_a_verdict_and_on_restart() {
    let mut init = StaticInit::new(StaticConfig::DEFAULT);
    let still = |tick| turning(tick, rate(0.01));
    assert!(judge(&mut init, |tick| turning(tick, rate(0.2))).is_err());
    assert_eq!(judge(&mut init, still), Ok([AngularRate(0), AngularRate(0), rate(0.01)]));
    for tick in 0..u64::from(STATIC_SAMPLES) - 1 {
        assert_eq!(init.add(&turning(tick, rate(0.2)), false, false), None);
    }
    init.restart();
    assert_eq!(judge(&mut init, still), Ok([AngularRate(0), AngularRate(0), rate(0.01)]));
}

/// Limits that refuse nothing: for what the mean is, not whether it is believed.
const ANYTHING: StaticConfig = StaticConfig {
    gyro_std: f32::INFINITY,
    accel_std: f32::INFINITY,
    gyro_drift: f32::INFINITY,
    accel_drift: f32::INFINITY,
    gyro_bias: f32::INFINITY,
};

fn exact_mean(codes: impl Fn(u64) -> [i32; 3]) {
    let sum =
        |axis: usize| (0..u64::from(STATIC_SAMPLES)).map(|tick| i64::from(codes(tick)[axis])).sum::<i64>();
    // To nearest, halves up.
    let mean = |axis| AngularRate((2 * sum(axis) + 300).div_euclid(600) as i32);
    let bias = judge(&mut StaticInit::new(ANYTHING), |tick| ImuSample {
        angular_rate: codes(tick).map(AngularRate),
        specific_force: codes(tick).map(SpecificForce),
        ..turning(tick, AngularRate(0))
    });
    assert_eq!(bias, Ok([mean(0), mean(1), mean(2)]));
}

#[test]
fn mean_of_extremes_is_exact() {
    for code in [i32::MIN, i32::MAX, -1, 0, 1] {
        exact_mean(|_| [code; 3]);
    }
    exact_mean(|tick| if tick % 2 == 0 { [i32::MIN, i32::MAX, -1] } else { [i32::MAX, i32::MIN, 0] });
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn mean_is_exact(seed: u64, shift in 0u32..31) {
        let mut noise = Noise::new(seed);
        let codes: Vec<[i32; 3]> =
            (0..STATIC_SAMPLES).map(|_| std::array::from_fn(|_| noise.bits() as i32 >> shift)).collect();
        exact_mean(|tick| codes[tick as usize]);
    }
}
