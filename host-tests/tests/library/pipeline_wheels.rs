//! The pipeline does not initialise while the wheels turn, and reports a fault when they fall silent.

use gyronet::bias::StaticError;
use gyronet::can::wheel::WheelSettings;
use gyronet::health::Faults;
use gyronet::health::Status::{Degraded, Init};
use gyronet::pipeline::{BoardState, Output};
use gyronet::sample::{PERIOD_US, Standstill, WheelSample};
use gyronet::units::{Micros, WheelSpeed};
use gyronet_host_tests::stream::{faults, new, statuses};
use gyronet_host_tests::synthetic::{rate, turning};
use gyronet_host_tests::wire;
use gyronet_tools::drive::wheel_frames::receiver;

const TIMEOUT: u64 = WheelSettings::TOYOTA.timeout.0;

/// A gyro that reads a constant; `wheels` gives the speed of each tick in km/h, where a
/// frame comes with it.
fn run(ticks: u64, mut wheels: impl FnMut(u64) -> Option<f64>) -> Vec<Output> {
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
    let outputs = run(1_000, |tick| Some(0.4 * 125.min(500u64.saturating_sub(tick)) as f64));
    assert_eq!(statuses(&outputs), [(Init, 800), (Degraded, 200)]);
    let refused: Vec<usize> = (0..1_000).filter(|&k| outputs[k].refused.is_some()).collect();
    assert_eq!(refused, [0], "said once");
    assert_eq!(outputs[0].refused, Some(StaticError::Wheels));
    assert_eq!(faults(&outputs), [(Faults::NONE, 800 + 11), (Faults::LATE, 200 - 11)]);
    // Not known to move: the sensor alone decides, as it does without wheels.
    assert_eq!(statuses(&run(400, |_| None))[0], (Init, 300));
}

#[test]
fn one_turn_of_a_wheel_starts_it_again() {
    let outputs = run(1_000, |tick| Some(if tick == 200 { 0.2 } else { 0.0 }));
    assert_eq!(outputs[200].refused, Some(StaticError::Wheels));
    assert_eq!(statuses(&outputs)[0], (Init, 201 + 300));
}

#[test]
fn silent_wheels_are_a_fault() {
    // Not heard yet, which is no fault; then heard, then lost after the time-out, then back.
    let outputs = run(290, |tick| ((50..100).contains(&tick) || tick >= 200).then_some(0.0));
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
