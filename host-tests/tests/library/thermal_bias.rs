//! The bias by temperature that earlier drives have shown: what it does before the first standstill, while the sensor
//! warms up, and after the sensor was moved.

use gyronet::bias::ThermalBias;
use gyronet::estimate::YawEstimate;
use gyronet::health::slow::Knowledge;
use gyronet::health::{Faults, Quality, Status};
use gyronet::pipeline::{BoardState, Output, Pipeline, PipelineConfig, UncertaintyConfig};
use gyronet::sample::{ImuSample, Standstill, WHEELS, WheelSample};
use gyronet::units::{CentiCelsius, WheelSpeed};
use gyronet::{Config, Coprocessor};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{force, noisy, rate, turning};

const BIAS: f64 = 0.004;
const PER_KELVIN: f64 = 8.7e-5;
/// Noise of a gyro and an accelerometer, rad/s and m/s^2.
const NOISE: [f64; 2] = [0.001, 0.02];

/// Bias of the sensor at a temperature, rad/s.
fn bias(celsius: f64) -> f64 {
    BIAS + PER_KELVIN * (celsius - 20.0)
}

/// The configuration for the sensor, whose bias five starts have shown from 15 to 65 deg C.
fn known() -> PipelineConfig {
    let rest_force = Some(turning(0, rate(0.0)).specific_force);
    let mut thermal_bias = ThermalBias::UNKNOWN;
    for celsius in (0..5).flat_map(|_| (15..65).step_by(2)) {
        let shown = [rate(bias(f64::from(celsius))); 3];
        thermal_bias.add(celsius == 15, CentiCelsius(celsius * 100), shown);
    }
    PipelineConfig { thermal_bias, rest_force, ..PipelineConfig::DEFAULT }
}

/// Runs a sensor with this temperature at each tick; the vehicle stands where it does not drive. Its yaw rate
/// is `turns`, rad/s, where it drives.
fn run(
    config: PipelineConfig,
    ticks: u64,
    celsius: impl Fn(u64) -> f64,
    drives: impl Fn(u64) -> bool,
    turns: f64,
) -> (Pipeline, Vec<Output>) {
    let mut pipeline = Pipeline::new(config);
    let mut noise = Noise::new(7);
    let outputs = (0..ticks).map(|tick| {
        let (celsius, drives) = (celsius(tick), drives(tick));
        let temperature = Some(CentiCelsius((100.0 * celsius) as i16));
        let turn = if drives { turns } else { 0.0 };
        let angular_rate = [0.0, 0.0, turn].map(|turn| rate(bias(celsius) + turn));
        let sample = ImuSample { temperature, angular_rate, ..turning(tick, rate(0.0)) };
        let sample = noisy(sample, NOISE, &mut noise);
        let standstill = if drives { Standstill::Moving } else { Standstill::Still };
        let speeds = [Some(WheelSpeed(if drives { 65_536 } else { 0 })); WHEELS];
        let wheels = WheelSample { time: sample.time, speeds, standstill };
        pipeline.correct(sample, Some(&wheels), &BoardState::GOOD).expect("a place on the grid")
    });
    let outputs = outputs.collect();
    (pipeline, outputs)
}

/// Sigma of the bias, rad/s: no network corrects these drives.
fn bias_sigma(output: &Output) -> f64 {
    let sigma = output.vehicle.delayed.sigma.expect("known").rad_per_sec();
    let uncorrected = f64::from(UncertaintyConfig::DEFAULT.uncorrected);
    (sigma * sigma - uncorrected * uncorrected).sqrt()
}

#[test]
fn a_vehicle_that_drives_off_at_once_has_a_rate_with_its_sigma() {
    let (pipeline, without) = run(PipelineConfig::DEFAULT, 500, |_| 35.0, |_| true, 0.1);
    assert_eq!(pipeline.status(None).bias, Knowledge::Unknown);
    assert!(without.iter().all(|output| output.vehicle.delayed.status == Status::Init));
    let (pipeline, with) = run(known(), 500, |_| 35.0, |_| true, 0.1);
    assert_eq!(pipeline.status(None).bias, Knowledge::Coarse);
    // The first second shows whether the sensor is where it was.
    let (first, with) = with.split_at(100);
    assert!(first.iter().all(|output| output.vehicle.delayed.status == Status::Init));
    for output in with {
        let delayed = output.vehicle.delayed;
        assert_eq!((delayed.status, delayed.quality), (Status::Degraded, Quality::Degraded));
        let sigma = delayed.sigma.expect("that of earlier drives").rad_per_sec();
        assert!((1e-4..1e-3).contains(&sigma), "{sigma}");
    }
    let mean = with.iter().map(|output| output.vehicle.delayed.rate.rad_per_sec()).sum::<f64>() / 400.0;
    assert!((mean - 0.1).abs() < 2e-4, "{mean}");
    // The yaw goes on from there.
    let yaw = with.last().expect("samples").vehicle.delayed.yaw.rad();
    assert!((yaw - 0.4).abs() < 2e-3, "{yaw}");
}

#[test]
fn hard_braking_is_no_sensor_that_was_moved() {
    let mut pipeline = Pipeline::new(known());
    let statuses = (0..1_000).map(|tick| {
        let mut sample = turning(tick, rate(bias(35.0) + 0.1));
        sample.temperature = Some(CentiCelsius(3_500));
        sample.angular_rate[0].0 += tick as i32 % 3;
        // 0.8 g for two seconds.
        sample.specific_force[0].0 -= if (400..600).contains(&tick) { force(7.8).0 } else { 0 };
        let wheels = WheelSample::without_speeds(Standstill::Moving);
        pipeline
            .correct(sample, Some(&wheels), &BoardState::GOOD)
            .expect("a place on the grid")
            .vehicle
            .delayed
            .status
    });
    assert!(statuses.skip(100).all(|status| status == Status::Degraded));
}

/// Nothing is learnt yet; the part has warmed up by 30 K before the vehicle stands for the first time, for three seconds.
#[test]
fn a_first_stop_shows_the_bias_at_its_own_temperature() {
    let celsius = |tick: u64| (tick / 100).min(30) as f64;
    let drives = |tick| !(3_000..3_400).contains(&tick);
    let (pipeline, outputs) = run(PipelineConfig::DEFAULT, 3_420, celsius, drives, 0.0);
    assert!(pipeline.gyro_bias().is_some(), "it has stood");
    let sigma = outputs.last().expect("samples").vehicle.delayed.sigma.expect("known").rad_per_sec();
    assert!(sigma < 4e-4, "{sigma}: none of the 30 K is left in it");
}

#[test]
fn warming_up_turns_the_vehicle_no_more_than_the_slope_s_error() {
    // Three seconds at rest at 20 deg C, then ten minutes of driving straight, in which the sensor warms by 30 K.
    let celsius = |tick: u64| 20.0 + 30.0 * (tick as f64 / 60_000.0);
    let turned = |outputs: &[Output]| outputs.last().expect("samples").vehicle.delayed.yaw.rad().to_degrees();
    let (_, without) = run(PipelineConfig::DEFAULT, 60_000, celsius, |tick| tick >= 400, 0.0);
    let (_, with) = run(known(), 60_000, celsius, |tick| tick >= 400, 0.0);
    let (unknown, learnt) = (turned(&without), turned(&with));
    // 0.0013 rad/s on average for ten minutes.
    assert!((35.0..55.0).contains(&unknown), "{unknown}");
    assert!(learnt.abs() < 0.1 * unknown, "{learnt} of {unknown}");
    // Where nothing is learnt the sigma has what a part may drift by over 30 K.
    let sigma = |outputs: &[Output]| bias_sigma(outputs.last().expect("samples"));
    assert!(sigma(&without) > 25.0 * PER_KELVIN, "{}", sigma(&without));
    assert!(sigma(&with) < 0.4 * sigma(&without), "{}", sigma(&with));
}

#[test]
fn a_sensor_that_was_moved_is_reported() {
    let was = Some([force(4.9), force(0.0), force(8.5)]);
    let moved = PipelineConfig { rest_force: was, ..known() };
    let (pipeline, outputs) = run(moved, 500, |_| 20.0, |tick| tick >= 400, 0.0);
    assert_eq!(pipeline.counters().moved_mounts, 1);
    let early = outputs.iter().take(290).map(|output| output.vehicle.delayed.status);
    assert!(
        early.into_iter().all(|status| status == Status::Init),
        "no early rate of a sensor that was moved"
    );
    let last = &outputs.last().expect("samples").vehicle.delayed;
    assert!(last.faults.contains(Faults::IMPLAUSIBLE));
    let (mut pipeline, outputs) = run(known(), 500, |_| 20.0, |tick| tick >= 400, 0.0);
    assert_eq!(pipeline.counters().moved_mounts, 0);
    // A drive has shown it.
    (0..2).for_each(|_| pipeline.mount_moved());
    assert_eq!(pipeline.counters().moved_mounts, 1);
    let next =
        pipeline.correct(turning(501, rate(0.0)), None, &BoardState::GOOD).expect("in order").vehicle.delayed;
    assert!(next.faults.contains(Faults::IMPLAUSIBLE));
    assert!(outputs.iter().all(|output| !output.vehicle.delayed.faults.contains(Faults::IMPLAUSIBLE)));
}

/// Xsens MTi sends its temperature once in a second, and may begin late.
#[test]
fn a_temperature_that_comes_late_makes_no_step() {
    for first in [150, 700] {
        let mut coprocessor = Coprocessor::new(Config { pipeline: known(), ..Config::DEFAULT });
        let mut noise = Noise::new(8);
        let mut sent = Vec::new();
        for tick in 0..2_000 {
            let temperature = (tick >= first && tick % 100 == first % 100).then_some(CentiCelsius(3_500));
            let angular_rate = [rate(bias(35.0)); 3];
            let sample = ImuSample { temperature, angular_rate, ..turning(tick, rate(0.0)) };
            let sample = noisy(sample, NOISE, &mut noise);
            let seen = coprocessor.imu(sample, sample.time, &mut ()).expect("in order").expect("a step");
            let known = (tick >= first).then_some(CentiCelsius(3_500));
            assert_eq!(seen.sample.and_then(|sample| sample.temperature), known, "sample {tick}");
            sent.push(seen.vehicle.delayed);
        }
        // Until then nothing is corrected.
        let before = &sent[..first.min(300) as usize];
        let is_raw = |sent: &YawEstimate| sent.status == Status::Init && sent.rate.rad_per_sec() > 0.0;
        assert!(before.iter().all(is_raw), "from {first}");
        let after = &sent[800..];
        assert!(after.iter().all(|sent| sent.status == Status::Degraded), "from {first}");
        let mean = after.iter().map(|sent| sent.rate.rad_per_sec()).sum::<f64>() / after.len() as f64;
        assert!(mean.abs() < 2e-4, "from {first}: {mean}");
    }
}
