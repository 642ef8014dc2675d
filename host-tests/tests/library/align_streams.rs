//! Two streams with a clock each on one grid: rates, jitter, gaps, duplicates, jumps, order.

use gyronet::align::clock::{BoardTime, ClockError, JUMP_US, PartClock};
use gyronet::align::increments::Increments;
use gyronet::align::resample::{Quality, Resampler};
use gyronet::align::streams::{Fitted, MAX_DELAY_US, Step, Streams};
use gyronet::sample::{FogSample, ImuSample, PERIOD_US, Validity};
use gyronet::units::{Angle, AngularRate, Micros, SpecificForce};
use proptest::prelude::*;
use std::f64::consts::TAU;

const BOTH: Fitted = Fitted { imu: true, fog: true };
const IMU: Fitted = Fitted { imu: true, fog: false };
const FOG: Fitted = Fitted { imu: false, fog: true };

fn imu(stamp: u64, rate: i32) -> ImuSample {
    ImuSample {
        time: Micros(stamp),
        specific_force: [SpecificForce(0); 3],
        angular_rate: [AngularRate(0), AngularRate(0), AngularRate(rate)],
        temperature: None,
        validity: Validity::Good,
    }
}

fn fog(stamp: u64, angle: i64) -> FogSample {
    let increment = [None, None, Some(Angle(angle))];
    FogSample { time: Micros(stamp), span: 1_000, lost: 0, increment, temperature: None }
}

fn drain(streams: &mut Streams, now: u64) -> Vec<Step> {
    std::iter::from_fn(|| streams.next_step(Micros(now))).collect()
}

/// 1 rad/s peak at 1 Hz.
fn wave(time: u64) -> f64 {
    (TAU * time as f64 * 1e-6).sin() * f64::from(AngularRate::PER_RAD_PER_SEC)
}

/// The steps of a part with this period that starts at 3.7 ms, and how far they are off the wave.
fn resampled(period: f64) -> (Vec<Step>, f64) {
    let mut streams = Streams::new(IMU);
    let mut steps = Vec::new();
    let mut sent = 0;
    for now in (0..3_000_000).step_by(500) {
        let time = 3_700 + (f64::from(sent) * period) as u64;
        if time <= now {
            streams.add_imu(Micros(time), imu(time, wave(time) as i32)).expect("in order");
            sent += 1;
        }
        steps.extend(drain(&mut streams, now));
    }
    let error = |step: &Step| {
        let (sample, _) = step.imu.expect("no gaps");
        (f64::from(sample.angular_rate[2].0) - wave(step.time.0)).abs()
    };
    let worst = steps.iter().map(error).fold(0.0, f64::max) / f64::from(AngularRate::PER_RAD_PER_SEC);
    (steps, worst)
}

#[test]
fn samples_of_any_rate_are_interpolated() {
    // A straight line between samples T apart misses a sine by at most (2 pi f T)^2 / 8.
    let bound = |period: f64| (TAU * period * 1e-6).powi(2) / 8.0 + 1e-6;
    let (steps, worst) = resampled(1e6 / 120.0);
    assert!(steps.len() >= 297 && steps.iter().all(|s| s.imu.is_some_and(|i| i.1 == Quality::Interpolated)));
    assert!(worst <= bound(1e6 / 120.0), "120 Hz: {worst}");
    let (steps, _) = resampled(1e6 / 47.0);
    let held = steps.iter().filter(|s| matches!(s.imu, Some((_, Quality::Held { .. })))).count();
    println!("47 Hz, waited for 10 ms: {held} of {} steps held", steps.len());
    assert!(held > 0 && held < steps.len() * 6 / 10);
}

#[test]
fn increments_are_neither_lost_nor_made_up() {
    for phase in [0, 1, 300, 999] {
        let mut streams = Streams::new(FOG);
        let mut steps = Vec::new();
        for n in 1..=2_000u64 {
            let angle = (n * n % 1_000_003) as i64 * 1_000_001 - 500_000_000_000;
            let now = n * 1_000 + phase;
            // A part whose own clock started elsewhere.
            streams.add_fog(Micros(now), fog(77_000_000 + n * 1_000, angle)).expect("in order");
            steps.extend(drain(&mut streams, now));
        }
        let sum: i64 = steps.iter().map(|step| step.fog.angle[2].expect("good").0).sum();
        assert!(steps[1..].iter().all(|step| step.fog.covered == 10_000), "phase {phase}");
        // Off phase, the last millisecond's increment is still partly the next step's.
        if phase == 0 {
            let all = (1..=2_000u64).map(|n| (n * n % 1_000_003) as i64 * 1_000_001 - 500_000_000_000);
            assert_eq!(sum, all.sum::<i64>());
        }
        assert_eq!(streams.increments().late + streams.increments().dropped, 0);
    }
}

#[test]
fn interpolated_values_are_rounded_to_the_nearest_code() {
    for (last, at, due) in [(10, 20, 7), (-10, 20, -7), (10, 10, 3), (-10, 10, -3), (1, 15, 1), (-1, 15, -1)]
    {
        let mut resampler = Resampler::default();
        resampler.add(imu(0, 0));
        resampler.add(imu(30, last));
        let (sample, quality) = resampler.at(Micros(at)).expect("between two samples");
        assert_eq!((sample.angular_rate[2].0, quality), (due, Quality::Interpolated), "{last} at {at} us");
    }
}

proptest! {
    /// An increment that straddles a grid step is split there in proportion to time, rounded towards
    /// zero, whatever its size; the second part is what is left of it.
    #[test]
    fn an_increment_is_split_in_proportion(
        angle in prop_oneof![any::<i64>(), Just(i64::MIN + 1), Just(i64::MAX), -1_000_000..1_000_000_i64],
        span in 2..=PERIOD_US as u32,
        part in any::<prop::sample::Index>(),
    ) {
        let before = 1 + part.index(span as usize - 1) as u64;
        let step = 10 * PERIOD_US;
        let mut increments = Increments::default();
        let end = Micros(step - before + u64::from(span));
        increments.add(end, &FogSample { span, ..fog(end.0, angle) });
        let first = (i128::from(angle) * i128::from(before) / i128::from(span)) as i64;
        let [_, _, taken] = increments.take(Micros(step)).angle;
        prop_assert_eq!(taken, Some(Angle(first)));
        let [_, _, rest] = increments.take(Micros(step + PERIOD_US)).angle;
        prop_assert_eq!(rest, Some(Angle(angle - first)));
    }
}

#[test]
fn lost_increments_are_marked() {
    let mut streams = Streams::new(FOG);
    let mut steps = Vec::new();
    for n in 1..=100u64 {
        if (43..=45).contains(&n) {
            continue;
        }
        let lost = if n == 46 { 3 } else { 0 };
        let increment = if n == 77 { [None; 3] } else { fog(0, 1_000).increment };
        let sample = FogSample { lost, increment, ..fog(n * 1_000, 1_000) };
        streams.add_fog(Micros(n * 1_000), sample).expect("in order");
        steps.extend(drain(&mut streams, n * 1_000));
    }
    let of = |k: usize| (steps[k].fog.covered, steps[k].fog.angle[2]);
    assert_eq!(of(3), (10_000, Some(Angle(10_000))));
    assert_eq!(of(4), (7_000, Some(Angle(7_000))));
    assert_eq!(of(7), (10_000, None));
    assert_eq!(of(8), (10_000, Some(Angle(10_000))));
    assert_eq!(streams.increments().gaps, 1);
}

#[test]
fn no_step_is_later_than_ten_milliseconds() {
    // Each stream is silent for a while, the other goes on; then both.
    let mut streams = Streams::new(BOTH);
    let (mut steps, mut worst) = (Vec::new(), 0);
    for now in (0..2_000_000u64).step_by(100) {
        let silent = now / 100_000 % 4;
        if now % 10_000 == 4_200 && silent & 1 == 0 {
            streams.add_imu(Micros(now), imu(now, 5)).expect("in order");
        }
        if now % 1_000 == 300 && silent & 2 == 0 {
            streams.add_fog(Micros(now), fog(now, 5)).expect("in order");
        }
        for step in drain(&mut streams, now) {
            worst = worst.max(now.saturating_sub(step.time.0));
            steps.push(step);
        }
    }
    println!("latest step {worst} us after its time");
    assert!(worst <= MAX_DELAY_US);
    assert!(steps.windows(2).all(|pair| pair[1].time.0 - pair[0].time.0 == PERIOD_US));
    assert!(steps.len() >= 198);
    // Silent streams are marked, not made up.
    let at = |ms: u64| steps.iter().find(|step| step.time.0 == ms * 1_000).expect("a step");
    assert!(at(50).imu.is_some() && at(50).fog.covered == 10_000);
    assert!(at(150).imu.is_none() && at(150).fog.covered == 10_000);
    assert!(at(250).imu.is_some() && at(250).fog.covered == 0 && at(250).fog.angle == [None; 3]);
    assert!(at(350).imu.is_none() && at(350).fog.covered == 0);
}

#[test]
fn gaps_of_the_inertial_sensor_are_bridged_or_reported() {
    // A resampler alone: nobody waits for the samples.
    let mut resampler = Resampler::default();
    let mut samples = [5_000, 15_000, 75_000, 190_000, 200_000].into_iter().peekable();
    let mut at = |time: u64| {
        while !resampler.has_reached(Micros(time)) {
            let next = samples.next().expect("a sample");
            resampler.add(imu(next, next as i32));
        }
        resampler.at(Micros(time))
    };
    let mut quality = |ms: u64| at(ms * 1_000);
    assert_eq!(quality(10), Some((imu(10_000, 10_000), Quality::Interpolated)));
    assert_eq!(quality(40), Some((imu(40_000, 40_000), Quality::Bridged { gap: 60_000 })));
    assert_eq!(quality(120), None);
    assert_eq!(quality(190), Some((imu(190_000, 190_000), Quality::Exact)));
}

#[test]
fn events_of_a_clock_are_reported() {
    let mut clock = PartClock::default();
    let mut at = |stamp, arrival| clock.translate(Micros(stamp), Micros(arrival));
    let board = |time, jumped| Ok(BoardTime { time: Micros(time), jumped });
    // The first arrival was 3 ms late, as the second shows; the third is 5 ms late.
    assert_eq!(at(910_000, 503_000), board(503_000, false));
    assert_eq!(at(920_000, 510_000), board(510_000, false));
    assert_eq!(at(930_000, 525_000), board(520_002, false));
    assert_eq!(at(930_000, 526_000), Err(ClockError::Duplicate { at: Micros(930_000) }));
    let (last, early) = (Micros(930_000), Micros(929_000));
    assert_eq!(at(929_000, 527_000), Err(ClockError::OutOfOrder { last, at: early }));
    // The part restarts; then its messages are held up, for longer than any jitter the second time.
    assert_eq!(at(0, 530_000), board(530_000, true));
    assert_eq!(at(10_000, 540_000 + JUMP_US), board(540_002, false));
    assert_eq!(at(20_000, 560_000 + 2 * JUMP_US), board(560_000 + 2 * JUMP_US, true));
    let counters = clock.counters();
    assert_eq!((counters.samples, counters.late, counters.duplicates), (6, 2, 1));
    assert_eq!((counters.out_of_order, counters.jumps), (1, 2));
}

#[test]
fn a_small_jump_is_found_within_a_second() {
    let mut clock = PartClock::default();
    for n in 0..300u64 {
        // From the hundredth sample on the stamps are 40 ms behind.
        let stamp = 1_000_000 + n * 10_000 - if n >= 100 { 40_000 } else { 0 };
        let board = clock.translate(Micros(stamp), Micros(n * 10_000));
        let Ok(board) = board else {
            assert!((100..=104).contains(&n), "sample {n}");
            continue;
        };
        assert_eq!(board.jumped, n == 201, "sample {n}");
        assert!(board.time.0.abs_diff(n * 10_000) < 10 || (100..201).contains(&n), "sample {n}");
    }
    assert_eq!(clock.counters().jumps, 1);
    // Silence is not lateness.
    assert!(!clock.translate(Micros(13_950_000), Micros(12_995_000)).expect("in order").jumped);
}

#[test]
fn a_slow_clock_is_followed() {
    // 100 ppm slow, arrivals jitter by up to 1.5 ms: after a minute the stamps are 6 ms behind.
    let mut clock = PartClock::default();
    let mut worst = 0;
    for n in 1..=6_000u64 {
        let truth = n * 10_000;
        let stamp = truth - truth / 10_000;
        let arrival = truth + 500 + n * 7_919 % 1_500;
        let board = clock.translate(Micros(stamp), Micros(arrival)).expect("in order").time;
        worst = worst.max(board.0.abs_diff(truth + 500));
    }
    println!("100 ppm slow with 1.5 ms of jitter: at most {worst} us off");
    assert!(worst <= 1_500);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever comes, steps ascend by 10 ms but for restarts, and nothing panics.
    #[test]
    fn any_times_are_survived(
        events in prop::collection::vec((any::<bool>(), 0..30_000u64, -200_000..200_000i64, 0..4u8), 0..300),
        wild in any::<Option<u64>>(),
    ) {
        let mut streams = Streams::new(BOTH);
        let (mut now, mut last) = (1_000_000u64, None);
        for (is_imu, passed, off, kind) in events {
            now += passed;
            let stamp = match kind {
                0 => wild.unwrap_or(now),
                1 => now.wrapping_add_signed(off),
                _ => now,
            };
            if is_imu {
                let _ = streams.add_imu(Micros(now), imu(stamp, i32::MIN));
            } else {
                let _ = streams.add_fog(Micros(now), FogSample { span: passed as u32, ..fog(stamp, i64::MAX) });
            }
            let restarts = streams.restarts();
            for step in drain(&mut streams, now) {
                prop_assert!(last.is_none_or(|last| step.time.0 == last + PERIOD_US) || restarts > 0);
                prop_assert!(u64::from(step.fog.covered) <= PERIOD_US);
                last = Some(step.time.0);
            }
        }
    }
}
