//! The watch over the sensor, on the host: silence by the board's clock, readings that stand
//! still, saturation, and the weights' checksum in the background.

use gyronet::guard::{AXIS_STUCK_AFTER, Guard, HOLD, START_US, STUCK_AFTER, TIMEOUT_US};
use gyronet::health::{Faults, Quality, Source, Status};
use gyronet::model::background::BackgroundCheck;
use gyronet::model::{Blob, BlobError, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{ImuSample, PERIOD_US, Standstill, WHEELS, WheelSample};
use gyronet::units::Micros;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::idling;

/// Both clocks agree, but for an offset.
const OFFSET_US: u64 = 7_000_003;

fn fed(samples: u64) -> (Guard, Noise) {
    let (mut guard, mut noise) = (Guard::new(PipelineConfig::DEFAULT), Noise::new(3));
    for tick in 0..samples {
        let output = guard.process(idling(tick, 0.001, &mut noise), at(tick)).expect("in time");
        assert!(guard.poll(at(tick)).is_none());
        assert!(matches!(output.prompt.status, Status::Init | Status::Degraded));
    }
    (guard, noise)
}

fn at(tick: u64) -> Micros {
    Micros(OFFSET_US + tick * PERIOD_US)
}

#[test]
fn silence_has_no_rate_and_ends_with_a_sample() {
    let (mut guard, mut noise) = fed(400);
    let quiet = at(399).0;
    assert!(guard.poll(Micros(quiet + TIMEOUT_US - 1)).is_none());
    let mut sets = Vec::new();
    for millisecond in TIMEOUT_US / 1_000..TIMEOUT_US / 1_000 + 100 {
        sets.extend(guard.poll(Micros(quiet + millisecond * 1_000)));
    }
    assert_eq!(sets.len(), 10, "one every 10 ms");
    for (set, tick) in sets.iter().zip(402..) {
        assert_eq!((set.tick, set.yaw.quality, set.yaw.rate.0), (tick, Quality::Unusable, 0));
        assert_eq!((set.yaw.faults, set.temperature), (Faults::GAP, None));
    }
    assert_eq!(guard.counters().silences, 1);
    let output = guard.process(idling(412, 0.001, &mut noise), at(412)).expect("in time");
    assert_eq!((output.prompt.tick, output.prompt.status), (412, Status::Degraded), "the bias is kept");
    assert!(guard.poll(at(413)).is_none());
}

#[test]
fn silence_keeps_the_yaw() {
    let (mut guard, mut noise) = fed(400);
    let output = guard.process(idling(400, 0.001, &mut noise), at(400)).expect("in time");
    let set = guard.poll(Micros(at(400).0 + TIMEOUT_US)).expect("told");
    assert_ne!(set.yaw.yaw.0, 0);
    assert_eq!((set.yaw.yaw, set.yaw.source), (output.vehicle.yaw.yaw, Source::Raw));
}

#[test]
fn a_part_has_time_to_start() {
    let mut guard = Guard::new(PipelineConfig::DEFAULT);
    assert!(guard.poll(Micros(START_US - 1)).is_none());
    let set = guard.poll(Micros(START_US)).expect("told");
    assert_eq!(set.yaw.quality, Quality::Unusable);
}

#[test]
fn what_is_known_of_the_wheels_is_handed_on() {
    let (mut guard, mut noise) = fed(400);
    let silent = WheelSample { time: Micros(0), speeds: [None; WHEELS], standstill: Standstill::Unknown };
    let mut told = |guard: &mut Guard, tick| {
        let output = guard.process(idling(tick, 0.001, &mut noise), at(tick)).expect("in time");
        output.vehicle.yaw.faults == output.vehicle.yaw.faults.with(Faults::WHEELS)
    };
    assert!(!told(&mut guard, 400));
    guard.wheels(silent);
    assert!(told(&mut guard, 401));
}

#[test]
fn samples_that_wait_are_no_silence() {
    let (mut guard, _) = fed(10);
    for tick in 10..100 {
        guard.wait(at(tick));
        assert!(guard.poll(at(tick)).is_none());
    }
}

#[test]
fn stuck_from_the_seventh_equal_sample_to_the_first_that_differs() {
    let (mut guard, mut noise) = fed(400);
    let still = idling(399, 0.001, &mut noise);
    let next = |guard: &mut Guard, tick: u64, sample: ImuSample| {
        let sample = ImuSample { time: Micros(tick * PERIOD_US), ..sample };
        guard.process(sample, at(tick)).expect("in time")
    };
    for tick in 400..440 {
        let output = next(&mut guard, tick, still);
        let stuck = tick >= 400 + u64::from(STUCK_AFTER);
        assert_eq!(output.prompt.status == Status::Stuck, stuck, "sample {tick}");
        assert_eq!(output.vehicle.prompt.quality == Quality::Unusable, stuck);
        let told = output.vehicle.yaw.faults.without(Faults::LATE);
        assert_eq!(told, if stuck { Faults::STUCK } else { Faults::NONE });
    }
    let moved = idling(440, 0.001, &mut noise);
    assert_eq!(next(&mut guard, 440, moved).prompt.status, Status::Degraded);
    assert_eq!(guard.counters().stuck, 1);
}

#[test]
fn a_gyro_or_one_axis_may_be_stuck_beside_axes_that_move() {
    for (axes, after) in [(&[0, 1, 2][..], STUCK_AFTER), (&[2], AXIS_STUCK_AFTER), (&[1], AXIS_STUCK_AFTER)] {
        let (mut guard, mut noise) = fed(400);
        let still = idling(399, 0.001, &mut noise);
        for tick in 400..500 {
            let mut sample = idling(tick, 0.001, &mut noise);
            for axis in axes {
                sample.angular_rate[*axis] = still.angular_rate[*axis];
            }
            let output = guard.process(sample, at(tick)).expect("in time");
            let stuck = tick >= 400 + u64::from(after);
            assert_eq!(output.prompt.status == Status::Stuck, stuck, "axes {axes:?}, sample {tick}");
        }
        assert_eq!(guard.counters().stuck, 1);
    }
}

#[test]
fn saturation_is_held_for_50_ms() {
    let (mut guard, mut noise) = fed(400);
    for tick in 400..420 {
        let sample = ImuSample { clipped: tick < 402, ..idling(tick, 0.001, &mut noise) };
        let output = guard.process(sample, at(tick)).expect("in time");
        let expected = if tick < 402 + u64::from(HOLD) { Status::Clipped } else { Status::Degraded };
        assert_eq!(output.prompt.status, expected, "sample {tick}");
    }
    assert_eq!(guard.counters().held, u32::from(HOLD));
}

#[test]
fn every_round_of_the_background_check_sees_a_flipped_bit() {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let mut check = BackgroundCheck::new(&blob);
    let round = |check: &mut BackgroundCheck| loop {
        if let Some(result) = check.advance(13) {
            return result;
        }
    };
    assert_eq!((round(&mut check), round(&mut check)), (Ok(()), Ok(())));
    let mut damaged = blob.content.to_vec();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    let mut check = BackgroundCheck::new(&Blob { content: &damaged, ..blob });
    assert!(matches!(round(&mut check), Err(BlobError::Crc { stored, .. }) if stored == blob.crc));
}
