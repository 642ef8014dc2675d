//! Samples of a vehicle that stands, turns or shakes, in the pipeline's fixed-point units.

use crate::noise::Noise;
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::health::{Quality, Source};
use gyronet::sample::{ImuSample, PERIOD_US, RATE_HZ, Standstill, Validity};
use gyronet::standstill::Standing;
use gyronet::units::{AngularRate, Micros, SpecificForce, Yaw};

pub fn rate(rad_per_sec: f64) -> AngularRate {
    AngularRate::from_rad_per_sec(rad_per_sec as f32).expect("a gyro's range")
}

pub fn deg_rate(deg_per_sec: f64) -> AngularRate {
    rate(deg_per_sec.to_radians())
}

pub fn force(metre_per_sec2: f64) -> SpecificForce {
    SpecificForce::from_metre_per_sec2(metre_per_sec2 as f32).expect("an accelerometer's range")
}

/// A level vehicle at grid step `tick` that turns at `yaw_rate` and does not move otherwise.
pub fn turning(tick: u64, yaw_rate: AngularRate) -> ImuSample {
    ImuSample {
        time: Micros(tick * PERIOD_US),
        specific_force: [SpecificForce(0), SpecificForce(0), force(9.81)],
        angular_rate: [AngularRate(0), AngularRate(0), yaw_rate],
        temperature: None,
        validity: Validity::Good,
    }
}

/// Adds white noise of these sigmas, rad/s and m/s^2, to every axis.
pub fn noisy(mut sample: ImuSample, [gyro, accelerometer]: [f64; 2], noise: &mut Noise) -> ImuSample {
    for axis in 0..3 {
        sample.angular_rate[axis].0 += rate(gyro * noise.normal()).0;
        sample.specific_force[axis].0 += force(accelerometer * noise.normal()).0;
    }
    sample
}

/// A vehicle that stands with its engine running: a 27 Hz shake and its overtone on every axis,
/// with some noise; `bias` (rad/s) on every gyro axis.
pub fn idling(tick: u64, bias: f64, noise: &mut Noise) -> ImuSample {
    let phase = std::f64::consts::TAU * 27.0 * tick as f64 / f64::from(RATE_HZ);
    let mut shake = |axis: usize| {
        (phase + axis as f64).sin() + 0.3 * (2.0 * phase + axis as f64).sin() + 0.2 * noise.normal()
    };
    let mut sample = turning(tick, AngularRate(0));
    for axis in 0..3 {
        sample.angular_rate[axis] = rate(bias + 0.02 * shake(axis));
        sample.specific_force[axis].0 += force(0.8 * shake(axis)).0;
    }
    sample
}

/// The judgement of a standstill by wheels that nothing contradicts.
pub fn judged(wheels: Standstill) -> Standing {
    if wheels == Standstill::Still { Standing::WHEELS } else { Standing::UNKNOWN }
}

pub fn estimate(rate: AngularRate, yaw: Yaw) -> YawEstimate {
    YawEstimate { rate, yaw, source: Source::Model, quality: Quality::Good, ..YawEstimate::default() }
}

/// The output for a vehicle that turns at `rate`, has turned by `yaw`, and has no fault.
pub fn vehicle(tick: u32, rate: AngularRate, yaw: Yaw) -> VehicleSample {
    VehicleSample {
        live: YawEstimate { rate, quality: Quality::Good, ..YawEstimate::default() },
        delayed: estimate(rate, yaw),
        tick,
        ..VehicleSample::default()
    }
}
