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
fn motion_is_refused() {
    let near = |found: f32, due: f32| (found / due - 1.0).abs() < 0.05;
    for axis in 0..3u8 {
        let (gyro, accel) = (usize::from(axis), usize::from(axis) + 3);
        // Starts to turn, and brakes, within the three seconds.
        let turn = idling_with(gyro, |t| 0.02 * (t - 1.0).max(0.0));
        assert!(
            matches!(turn, Err(StaticError::GyroDrift { axis: a, spread }) if a == axis && near(spread, 0.03)),
            "{turn:?}"
        );
        let brake = idling_with(accel, |t| -0.3 * (t - 1.0).max(0.0));
        assert!(
            matches!(brake, Err(StaticError::AccelDrift { axis: a, spread }) if a == axis && near(spread, 0.45)),
            "{brake:?}"
        );
        // Is shaken, by hand or by the road.
        let shaken = idling_with(gyro, |t| 0.12 * (30.0 * t).sin());
        assert!(
            matches!(shaken, Err(StaticError::GyroNoise { axis: a, std }) if a == axis && near(std, 0.086)),
            "{shaken:?}"
        );
        let road = idling_with(accel, |t| 3.0 * (70.0 * t).sin());
        assert!(
            matches!(road, Err(StaticError::AccelNoise { axis: a, std }) if a == axis && near(std, 2.2)),
            "{road:?}"
        );
        // Turns steadily, by more than any bias.
        let steady = idling_with(gyro, |_| -0.1);
        assert!(matches!(steady, Err(StaticError::GyroBias { axis: a, mean }) if a == axis && mean < -0.09));
    }
}

/// Whoever boards a vehicle, and the wind, rocks it and does not turn it. Wheels that stand are better evidence.
#[test]
fn a_calm_vehicle_may_be_rocked_and_not_turned() {
    let StaticConfig { gyro_drift, accel_drift, .. } = StaticConfig::DEFAULT;
    let [rocked, pushed] = [gyro_drift, accel_drift].map(|drift| 1.5 * f64::from(drift));
    for (axis, stands, is_calm, is_taken) in [
        (0, false, false, false),
        (0, false, true, true),
        (1, false, true, true),
        (2, false, true, false),
        (2, true, false, true),
    ] {
        let mut init = StaticInit::new(StaticConfig::DEFAULT);
        let verdict = (0..u64::from(STATIC_SAMPLES)).find_map(|tick| {
            let mut sample = turning(tick, AngularRate(0));
            sample.angular_rate[axis] = rate(if tick < 100 { rocked } else { 0.0 });
            sample.specific_force[0] = force(if tick < 100 { pushed } else { 0.0 });
            init.add(&sample, stands, is_calm)
        });
        assert_eq!(verdict.expect("a verdict").is_ok(), is_taken, "axis {axis}, {stands}, calm: {is_calm}");
    }
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

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn mean_is_exact(seed: u64, shift in 0u32..31) {
        let mut noise = Noise::new(seed);
        let codes: Vec<[i32; 3]> =
            (0..STATIC_SAMPLES).map(|_| std::array::from_fn(|_| noise.bits() as i32 >> shift)).collect();
        exact_mean(|tick| codes[tick as usize]);
        exact_mean(|tick| if tick < seed % 300 { [i32::MIN, i32::MAX, -1] } else { [i32::MAX, i32::MAX, 0] });
    }
}
