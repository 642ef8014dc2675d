//! The sensor monitor in the coprocessor: silence by the outside clock, readings that repeat themselves,
//! saturation, implausible readings; and the weights' checksum in the background.

use gyronet::coprocessor::{Clock, Config, Coprocessor, Observation};
use gyronet::health::{Faults, Quality, Source, Status};
use gyronet::model::background::BackgroundCheck;
use gyronet::model::{Blob, BlobError, Estimate, weights};
use gyronet::monitor::{AXIS_STUCK_AFTER, HOLD, START_US, STUCK_AFTER, SensorMonitor, TIMEOUT_US};
use gyronet::sample::{ImuSample, PERIOD_US, Validity};
use gyronet::units::Micros;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::synthetic::{idling, rate};
use gyronet_host_tests::wire::wheels;
use gyronet_tools::drive::wheel_frames::receiver;

/// Both clocks agree, but for an offset.
const OFFSET_US: u64 = 7_000_003;

fn coprocessor() -> Coprocessor {
    let wheels = Some(receiver());
    Coprocessor::new(Config { wheels, ..Config::DEFAULT })
}

fn fed(samples: u64) -> (Coprocessor, Noise) {
    let (mut coprocessor, mut noise) = (coprocessor(), Noise::new(3));
    for tick in 0..samples {
        let observation = sample(&mut coprocessor, idling(tick, 0.001, &mut noise), tick);
        assert_eq!(coprocessor.poll(at(tick), &mut ()), Ok(None));
        assert!(matches!(observation.vehicle.live.status, Status::Init | Status::Degraded));
    }
    (coprocessor, noise)
}

fn at(tick: u64) -> Micros {
    Micros(OFFSET_US + tick * PERIOD_US)
}

fn sample(coprocessor: &mut Coprocessor, sample: ImuSample, tick: u64) -> Observation {
    let sample = ImuSample { time: Micros(tick * PERIOD_US), ..sample };
    coprocessor.imu(sample, at(tick), &mut ()).expect("in time").expect("a step")
}

#[test]
fn silence_has_no_rate_and_ends_with_a_sample() {
    // A part has time to start.
    let mut started = coprocessor();
    assert_eq!(started.poll(Micros(START_US - 1), &mut ()), Ok(None));
    let set = started.poll(Micros(START_US), &mut ()).expect("time goes on").expect("a set");
    assert_eq!(set.vehicle.delayed.quality, Quality::Unusable);
    let (mut coprocessor, mut noise) = fed(399);
    let last = sample(&mut coprocessor, idling(399, 0.001, &mut noise), 399).vehicle.delayed;
    assert_ne!(last.yaw.0, 0);
    let quiet = at(399).0;
    assert_eq!(coprocessor.poll(Micros(quiet + TIMEOUT_US - 1), &mut ()), Ok(None));
    let (mut sets, mut sent) = (Vec::new(), Sent::default());
    for millisecond in TIMEOUT_US / 1_000..TIMEOUT_US / 1_000 + 100 {
        sets.extend(coprocessor.poll(Micros(quiet + millisecond * 1_000), &mut sent).expect("time goes on"));
    }
    let last_set = sent.frames.last().expect("ten sets").time;
    assert_eq!(last_set, Micros(399 * PERIOD_US + TIMEOUT_US + 90_000), "by the sensor's clock");
    assert_eq!(sets.len(), 10, "one every 10 ms");
    for (Observation { sample, vehicle: set, .. }, tick) in sets.into_iter().zip(402..) {
        let rate = set.delayed;
        assert_eq!((rate.yaw, rate.source, sample), (last.yaw, Source::Raw, None), "the yaw is kept");
        assert_eq!((set.tick, rate.quality, rate.rate.0), (tick, Quality::Unusable, 0));
        assert_eq!((rate.faults, rate.status, set.temperature), (Faults::GAP, Status::Silent, None));
    }
    assert_eq!(coprocessor.monitor_counters().silences, 1);
    let set = sample(&mut coprocessor, idling(412, 0.001, &mut noise), 412).vehicle;
    assert_eq!((set.live.tick, set.live.status), (412, Status::Degraded), "the bias is kept");
    assert_eq!(coprocessor.poll(at(413), &mut ()), Ok(None));
    // Nobody has time for a set that should have gone out earlier, and it is of no use later.
    let late = at(412).0 + TIMEOUT_US + 45_000;
    let sets = [0, 1, 5_000, 9_999, PERIOD_US]
        .map(|after| coprocessor.poll(Micros(late + after), &mut ()).expect("time goes on").is_some());
    assert_eq!(sets, [true, false, false, false, true]);
}

/// The counter of an ICM-42688-P wraps every 69.9 ms, so that its stamps show a gap of 80 ms as one of 10 ms: for a second
/// the samples come late, then the time is lost.
#[test]
fn a_gap_that_the_stamps_do_not_show_is_found_by_the_arrivals() {
    const WRAP_US: u64 = 69_905;
    let (mut coprocessor, mut noise) = fed(400);
    for tick in 407..520 {
        let time = Micros(tick * PERIOD_US - WRAP_US);
        let sample = ImuSample { time, ..idling(tick, 0.001, &mut noise) };
        let now = Micros(at(tick).0 + tick % 7);
        let set = coprocessor.imu(sample, now, &mut ()).expect("in order").expect("a step").vehicle;
        assert_ne!(set.live.quality, Quality::Good, "{tick}");
    }
    assert_eq!(coprocessor.pipeline().counters().missing, 7);
}

/// The sensor's clock is 3 % slow, and the board reads nothing for four seconds: the samples wait.
#[test]
fn a_stall_with_a_slow_clock_loses_nothing() {
    let (mut coprocessor, mut noise) = fed(400);
    for tick in 400..1_400 {
        let taken = |tick| at(400).0 + (tick - 400) * (PERIOD_US + 300);
        let now = if (500..900).contains(&tick) { taken(900) } else { taken(tick) };
        let sample = ImuSample { time: Micros(tick * PERIOD_US), ..idling(tick, 0.001, &mut noise) };
        coprocessor.imu(sample, Micros(now), &mut ()).expect("in order");
    }
    assert_eq!(coprocessor.pipeline().counters().missing, 0);
}

/// By how much a sample of a vehicle with a good rate is late, us, beyond what a slow clock explains.
#[test]
fn a_sample_that_comes_late_is_older_and_beyond_29_ms_not_good() {
    let cases = [
        (Clock::Outside, 5_000, 0, Quality::Good),
        (Clock::Outside, 5_001, 5_001, Quality::Good),
        (Clock::Outside, 29_000, 29_000, Quality::Good),
        (Clock::Outside, 29_001, 29_001, Quality::Degraded),
        (Clock::Sensor, 29_001, 0, Quality::Good),
    ];
    for (clock, late, older, quality) in cases {
        let config = Config { clock, wheels: Some(receiver()), ..Config::DEFAULT };
        let (mut coprocessor, mut noise, mut sent) =
            (Coprocessor::new(config), Noise::new(3), Sent::default());
        for tick in 0..501 {
            let late = if tick == 500 { late + PERIOD_US / 16 } else { 0 };
            let now = Micros(at(tick).0 + late);
            let speed = if tick < 350 { 0.0 } else { 36.0 };
            coprocessor.can(&wheels(speed), now).expect("a wheel frame");
            coprocessor.imu(idling(tick, 0.001, &mut noise), now, &mut sent).expect("in order");
            if let Some(window) = coprocessor.window() {
                coprocessor.deliver(window.end, Estimate::NONE).expect("the window that is due");
            }
        }
        let [.., before, after] = &sent.seen[..] else { panic!("steps") };
        let (before, after) = (before.vehicle, after.vehicle);
        for (before, after) in [(before.live, after.live), (before.delayed, after.delayed)] {
            assert_eq!(before.quality, Quality::Good);
            let latency = before.latency_us.map(|latency| latency + older);
            assert_eq!((after.latency_us, after.quality), (latency, quality), "{late} us");
            assert_eq!(after.faults.contains(Faults::GAP), quality != Quality::Good);
        }
    }
}

#[test]
fn a_step_between_samples_is_as_old_as_the_time_that_it_has_waited() {
    let (mut coprocessor, mut noise, mut sent) = (coprocessor(), Noise::new(3), Sent::default());
    for tick in (0..200).step_by(2) {
        coprocessor.imu(idling(tick, 0.001, &mut noise), at(tick), &mut sent).expect("in order");
    }
    let [.., between, newest] = sent.seen[..] else { panic!("steps") };
    assert_eq!([between, newest].map(|seen| seen.vehicle.live.latency_us), [Some(10_000), Some(0)]);
}

/// All axes with the accelerometer's, the gyro alone, or one axis beside axes that move.
#[test]
fn stuck_from_the_seventh_equal_sample_to_the_first_that_differs() {
    let cases: [(Option<&[usize]>, u32); 4] = [
        (None, STUCK_AFTER.into()),
        (Some(&[0, 1, 2]), STUCK_AFTER.into()),
        (Some(&[2]), AXIS_STUCK_AFTER.into()),
        (Some(&[1]), AXIS_STUCK_AFTER.into()),
    ];
    for (axes, after) in cases {
        let (mut coprocessor, mut noise) = fed(400);
        let still = idling(399, 0.001, &mut noise);
        for tick in 400..500 {
            let mut moving = idling(tick, 0.001, &mut noise);
            match axes {
                None => moving = still,
                Some(axes) => axes.iter().for_each(|at| moving.angular_rate[*at] = still.angular_rate[*at]),
            }
            let live = sample(&mut coprocessor, moving, tick).vehicle.live;
            let stuck = tick >= 400 + u64::from(after);
            assert_eq!(live.status == Status::Stuck, stuck, "{axes:?}, sample {tick}");
            assert_eq!(live.quality == Quality::Unusable, stuck);
            // Nobody runs the network here.
            let faults = if stuck { Faults::STUCK } else { Faults::NONE };
            assert_eq!(live.faults.with(Faults::LATE), faults.with(Faults::LATE));
        }
        let moved = idling(500, 0.001, &mut noise);
        assert_eq!(sample(&mut coprocessor, moved, 500).vehicle.live.status, Status::Degraded);
        assert_eq!(coprocessor.monitor_counters().stuck, 1);
    }
}

#[test]
fn an_axis_that_seldom_repeats_a_reading_is_stuck_after_seven_and_another_after_thirty() {
    for (holds, after) in [(1, STUCK_AFTER), (2, AXIS_STUCK_AFTER)] {
        let (mut monitor, mut noise, mut last) = (SensorMonitor::new(false), Noise::new(3), rate(0.0));
        for tick in 0..1_100 {
            let mut sample = idling(tick, 0.001, &mut noise);
            if tick > 1_000 || tick % holds > 0 {
                sample.angular_rate[2] = last;
            }
            last = sample.angular_rate[2];
            let is_stuck = monitor.judge(&sample) == Validity::Stuck;
            assert_eq!(is_stuck, tick >= 1_000 + u64::from(after), "{after}: {tick}");
        }
    }
}

#[test]
fn saturation_is_held_for_50_ms() {
    let (mut coprocessor, mut noise) = fed(400);
    for tick in 400..420 {
        let mut reading =
            ImuSample { validity: Validity::reported(tick < 402), ..idling(tick, 0.001, &mut noise) };
        if (402..407).contains(&tick) {
            // Its filter recovers.
            reading.angular_rate[2] = rate(2.0);
        }
        let observation = sample(&mut coprocessor, reading, tick);
        let (validity, status) = match tick {
            ..402 => (Validity::Saturated, Status::Clipped),
            402..407 => (Validity::Recovering, Status::Clipped),
            _ => (Validity::Good, Status::Degraded),
        };
        let judged = observation.sample.expect("a sample").validity;
        assert_eq!((judged, observation.vehicle.live.status), (validity, status), "sample {tick}");
    }
    let counters = coprocessor.monitor_counters();
    assert_eq!((counters.held, counters.wrong), (u32::from(HOLD), 0));
}

#[test]
fn every_round_of_the_background_check_sees_a_flipped_bit() {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let mut check = BackgroundCheck::new(blob.content, blob.crc);
    let round = |check: &mut BackgroundCheck| loop {
        if let Some(result) = check.advance(13) {
            return result;
        }
    };
    assert_eq!((round(&mut check), round(&mut check)), (Ok(()), Ok(())));
    let mut damaged = blob.content.to_vec();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    let mut check = BackgroundCheck::new(&damaged, blob.crc);
    assert!(matches!(round(&mut check), Err(BlobError::Crc { stored, .. }) if stored == blob.crc));
}
