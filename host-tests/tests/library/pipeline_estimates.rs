//! Estimates that come late, not at all or wrong, and rates that do not fit: the pipeline falls
//! back to the gyro less its bias, or says that there is no good rate. Wheels that turn, and wheels that fall silent.

use embedded_can::Frame;
use gyronet::bias::StaticError;
use gyronet::can::bosch::{Message, SignalStatus};
use gyronet::can::config::Config;
use gyronet::can::encoder::CanEncoder;
use gyronet::can::wheel::WheelSettings;
use gyronet::compensate::{CompensateConfig, Compensator, MAX_MEAN};
use gyronet::estimate::YawEstimate;
use gyronet::health::Status::{Degraded, Init, Ready};
use gyronet::health::{Faults, Quality, Source};
use gyronet::model::Estimate;
use gyronet::model::window::WINDOW;
use gyronet::pipeline::{BoardState, DueWindow, Output, Pipeline, PipelineConfig};
use gyronet::sample::{PERIOD_US, Standstill, WheelSample};
use gyronet::units::{AngularRate, Micros, WheelSpeed, Yaw};
use gyronet_host_tests::stream::{constant, drive, faults, new, run, statuses};
use gyronet_host_tests::synthetic::{rate, turning};
use gyronet_host_tests::wire;
use gyronet_tools::drive::wheel_frames::receiver;

/// The angle that the delayed rate owes where all samples that wait for it are alike, and no revision.
fn waiting(last: &YawEstimate) -> Yaw {
    Yaw(CompensateConfig::DEFAULT.lag.samples() as i64 * i64::from(last.rate.0))
}

#[test]
fn an_implausible_estimate_is_not_believed() {
    let mut pipeline = new();
    let limit = MAX_MEAN;
    let corrections = |due: &DueWindow| if due.end < 350 { limit } else { AngularRate(limit.0 + 1) };
    let outputs = run(&mut pipeline, drive(0..400), |due| {
        Some(Estimate { corrections: [corrections(due); WINDOW], clamped_inputs: 1, ..Estimate::NONE })
    });
    assert_eq!(statuses(&outputs), [(Init, 300), (Degraded, 11), (Ready, 45), (Degraded, 44)]);
    assert_eq!((pipeline.counters().implausible, pipeline.counters().clamped_inputs), (9, 18));
    assert_eq!(outputs.iter().filter(|output| output.implausible.is_some()).count(), 9);
    assert_eq!(faults(&outputs), [(Faults::NONE, 356), (Faults::IMPLAUSIBLE, 44)]);
    let last = outputs[399].vehicle.live;
    assert_eq!((last.correction, pipeline.pending()), (AngularRate(0), waiting(&last)));
    // One of ten times the mean's limit is vibration, more is not.
    for (largest, is_used) in [(10 * limit.0, true), (10 * limit.0 + 1, false)] {
        let mut estimate = Estimate::NONE;
        estimate.corrections[3] = AngularRate(-largest);
        assert_eq!(Compensator::new(CompensateConfig::DEFAULT).revise(&estimate).is_ok(), is_used);
    }
}

#[test]
fn a_rate_beyond_the_signal_is_marked() {
    let mut pipeline = new();
    let samples = (0..320).map(|tick| turning(tick, rate(if tick < 310 { 0.0 } else { 3.0 })));
    let outputs = run(&mut pipeline, samples, constant(0.0));
    let mut encoder = CanEncoder::new(Config::DEFAULT);
    for (number, tx1) in tx1(&mut encoder, &outputs).iter().enumerate() {
        let failed = (tx1.rate, tx1.rate_status) == (0xFFFF, SignalStatus::FAILURE);
        assert_eq!(failed, number >= 310, "{number}");
    }
    assert_eq!(encoder.out_of_range, 10);
    // Neither do the largest codes wrap.
    let samples = (0..400).map(|tick| turning(tick, AngularRate(if tick < 300 { 1_000 } else { i32::MIN })));
    let outputs = run(&mut new(), samples, constant(0.01));
    assert_eq!(outputs[399].vehicle.live.rate, AngularRate(i32::MIN));
    let last = *tx1(&mut CanEncoder::new(Config::DEFAULT), &outputs).last().expect("samples");
    assert_eq!((last.rate, last.rate_status), (0, SignalStatus::FAILURE));
}

fn tx1(encoder: &mut CanEncoder, outputs: &[Output]) -> Vec<Message> {
    let mut first = |output: &Output| encoder.encode(&output.vehicle)[0];
    outputs.iter().map(|output| Message::parse(first(output).data()).expect("a good checksum")).collect()
}

#[test]
fn a_model_that_is_switched_off_corrects_nothing_and_the_rate_is_good() {
    let mut config = PipelineConfig::DEFAULT;
    config.compensate.model = false;
    let outputs = |config, network: &mut dyn FnMut(&DueWindow) -> Option<Estimate>| {
        run(&mut Pipeline::new(config), drive(0..600), network)
    };
    // A correction of any size is neither used nor refused.
    let off = outputs(config, &mut constant(9.0));
    let on = outputs(PipelineConfig::DEFAULT, &mut constant(0.0));
    for (off, on) in off.iter().zip(&on) {
        for (off, on) in [(off.vehicle.live, on.vehicle.live), (off.vehicle.delayed, on.vehicle.delayed)] {
            let source = if on.source == Source::Model { Source::Static } else { on.source };
            assert_eq!(off, YawEstimate { source, sigma: off.sigma, ..on });
            // The network expects a small error of what it corrects.
            assert!(on.source != Source::Model || off.sigma > on.sigma);
        }
    }
    let last = off.last().expect("samples").vehicle.delayed;
    assert_eq!((last.source, last.status), (Source::Static, Ready));
}

#[test]
fn the_rate_of_a_sensor_that_was_moved_is_degraded() {
    // A bias beyond doubt.
    let mut pipeline = Pipeline::new(PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT });
    let mut quality = |ticks| {
        let outputs = run(&mut pipeline, drive(ticks), constant(0.0));
        let quality = outputs.last().expect("samples").vehicle.delayed.quality;
        pipeline.mount_moved();
        quality
    };
    assert_eq!([quality(0..900), quality(900..910)], [Quality::Good, Quality::Degraded]);
}

const TIMEOUT: u64 = WheelSettings::TOYOTA.timeout.0;

/// A gyro that reads a constant; `wheels` gives the speed of each tick in km/h, where a
/// frame comes with it.
fn wheeled(ticks: u64, mut wheels: impl FnMut(u64) -> Option<f64>) -> Vec<Output> {
    let (mut pipeline, mut receiver) = (new(), receiver());
    let step = |tick: u64| {
        let now = Micros(tick * PERIOD_US);
        if let Some(speed) = wheels(tick) {
            receiver.decode(&wire::wheels(speed), now).expect("a wheel frame").expect("a good one");
        }
        let known = receiver.poll(now);
        pipeline
            .correct(turning(tick, rate(0.001)), known.as_ref(), &BoardState::GOOD)
            .expect("a place on the grid")
    };
    (0..ticks).map(step).collect()
}

#[test]
fn static_initialisation_waits_for_the_wheels() {
    // A steady straight drive looks like standing to the gyro; then it brakes at 11 m/s^2.
    let outputs = wheeled(1_000, |tick| Some(0.4 * 125.min(500u64.saturating_sub(tick)) as f64));
    assert_eq!(statuses(&outputs), [(Init, 800), (Degraded, 200)]);
    let refused: Vec<usize> = (0..1_000).filter(|&k| outputs[k].refused.is_some()).collect();
    assert_eq!(refused, [0], "said once");
    assert_eq!(outputs[0].refused, Some(StaticError::Wheels));
    assert_eq!(faults(&outputs), [(Faults::NONE, 800 + 11), (Faults::LATE, 200 - 11)]);
    // Not known to move: the sensor alone decides, as it does without wheels.
    assert_eq!(statuses(&wheeled(400, |_| None))[0], (Init, 300));
}

#[test]
fn silent_wheels_are_a_fault() {
    // Not heard yet, which is no fault; then heard, then lost after the time-out, then back.
    let outputs = wheeled(290, |tick| ((50..100).contains(&tick) || tick >= 200).then_some(0.0));
    let lost = (99 * PERIOD_US + TIMEOUT) / PERIOD_US + 1;
    assert_eq!(
        faults(&outputs),
        [(Faults::NONE, lost as usize), (Faults::WHEELS, 200 - lost as usize), (Faults::NONE, 90)]
    );
}

/// A vehicle of which two wheels are read has lost none.
#[test]
fn one_wheel_that_falls_silent_is_a_fault_and_one_that_never_spoke_is_none() {
    let [speed, none] = [Some(WheelSpeed(0)), None];
    let mut pipeline = new();
    for (tick, speeds, is_lost) in [
        (0, [speed, speed, none, none], false),
        (1, [speed, none, none, none], true),
        (2, [speed, speed, none, none], false),
        (3, [none; 4], true),
    ] {
        let sample = turning(tick, rate(0.001));
        let wheels = WheelSample { time: sample.time, speeds, standstill: Standstill::Unknown };
        let output = pipeline.correct(sample, Some(&wheels), &BoardState::GOOD).expect("in time");
        assert_eq!(output.vehicle.live.faults.0 & Faults::WHEELS.0 != 0, is_lost, "{speeds:?}");
    }
    let (tick, silent) = (pipeline.tick(), pipeline.silent(3, &BoardState::GOOD));
    assert_eq!([silent.live.tick, silent.delayed.tick, silent.tick], [tick + 3; 3]);
}
