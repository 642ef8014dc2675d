//! Samples of any rate on the 100 Hz grid: what goes in comes out, and no way to get stuck.

use gyronet::align::{AlignError, Aligner, MAX_GAP, PERIODS_US, SNAP_US};
use gyronet::sample::{Frame, ImuSample, PERIOD_US, Validity};
use gyronet::units::{AngularRate, CentiCelsius, Micros, SpecificForce};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::synthetic::turning;
use proptest::prelude::*;

const STEP: i64 = PERIOD_US as i64;

fn sample(time: u64, rate: i32) -> ImuSample {
    ImuSample { time: Micros(time), ..turning(0, AngularRate(rate)) }
}

fn steps(aligner: &mut Aligner, sample: ImuSample) -> Result<Vec<Frame>, AlignError> {
    aligner.add(sample)?;
    Ok(std::iter::from_fn(|| aligner.next_frame()).collect())
}

/// Tick and missing steps of a sample at this time that is a step of its own, or why it is not used.
fn place(aligner: &mut Aligner, time: u64) -> Result<(u32, u32), AlignError> {
    let sample = sample(time, 7);
    let frames = steps(aligner, sample)?;
    let [frame] = frames[..] else { panic!("{time}: {frames:?}") };
    assert_eq!(frame.sample, sample);
    Ok((frame.tick, frame.missing))
}

/// An aligner whose last sample was tick 0 at this time.
fn begun(time: u64) -> Aligner {
    let mut aligner = Aligner::START;
    assert_eq!(place(&mut aligner, time), Ok((0, 0)));
    aligner
}

/// Runs samples at these times with random rates, and compares each step with the mean of the time that it covers.
fn compare(times: &[u64], hz: u64) {
    let mut noise = Noise::new(hz);
    let samples: Vec<_> =
        times.iter().map(|time| sample(*time, noise.int(-(1 << 30), 1 << 30) as i32)).collect();
    let mut aligner = Aligner::START;
    let frames: Vec<_> = samples.iter().flat_map(|sample| steps(&mut aligner, *sample).unwrap()).collect();
    let covers = |pair: &[ImuSample], from: i64, to: i64| {
        (pair[1].time.0 as i64).min(to) - (pair[0].time.0 as i64).max(from)
    };
    let exact = |to: i64| {
        let parts = samples.windows(2).map(|pair| {
            let covered = covers(pair, to - STEP, to).max(0);
            i128::from(covered) * i128::from(pair[1].angular_rate[2].0)
        });
        parts.sum::<i128>() / i128::from(STEP)
    };
    let mut sums = [0_i128; 2];
    // Before that the rate is not known.
    for frame in frames.iter().filter(|frame| frame.tick > 25) {
        let end = times[0] as i64 + i64::from(frame.tick) * STEP;
        sums[0] += i128::from(frame.sample.angular_rate[2].0);
        sums[1] += exact(end);
        assert_eq!((frame.missing, frame.sample.validity), (0, Validity::Good), "{hz} Hz");
        // Near 100 Hz stamps move to the grid, and random readings make a random walk of that.
        let moved = if (91..=111).contains(&hz) { (20 * i128::from(SNAP_US)) << 31 } else { 0 };
        let off = (sums[0] - sums[1]).abs();
        assert!(off <= moved / i128::from(STEP) + frames.len() as i128, "{hz} Hz, {frame:?}: {off}");
    }
    let steps = (times[times.len() - 1] - times[0]) as usize / PERIOD_US as usize;
    assert!(frames.len() + 10 > steps, "{hz} Hz: {} of {steps}", frames.len());
}

#[test]
fn the_sum_of_the_steps_is_the_integral_of_the_samples() {
    for hz in [50, 62, 83, 95, 99, 100, 101, 104, 105, 120, 125, 200, 250, 333, 400, 500, 750, 1000] {
        let regular: Vec<u64> = (0..3 * hz).map(|k| 5_000_000 + k * 1_000_000 / hz).collect();
        compare(&regular, hz);
        let mut noise = Noise::new(hz);
        let jitter = 150_000 / hz as i64;
        let jittering: Vec<u64> =
            regular.iter().map(|time| time.strict_add_signed(noise.int(-jitter, jitter))).collect();
        compare(&jittering, hz);
    }
}

#[test]
fn jitter_at_100_hz_changes_no_bit() {
    let mut noise = Noise::new(4);
    let mut aligner = begun(1_000_000);
    for tick in 1..10_000 {
        let time = 1_000_000 + i64::from(tick) * STEP + noise.int(-(SNAP_US as i64), SNAP_US as i64);
        assert_eq!(place(&mut aligner, time as u64), Ok((tick, 0)));
    }
}

#[test]
fn a_mean_takes_every_axis_and_the_worst_validity() {
    let mut aligner = begun(0);
    let mut quarter = |k: u64, validity| {
        let n = k as i32;
        let sample = ImuSample {
            time: Micros(k * 2_500),
            specific_force: [n, 2 * n, 3 * n].map(SpecificForce),
            angular_rate: [4 * n, 5 * n, 6 * n].map(AngularRate),
            temperature: Some(CentiCelsius(n as i16)),
            validity,
        };
        steps(&mut aligner, sample).unwrap()
    };
    assert_eq!(quarter(1, Validity::Good), []);
    assert_eq!(quarter(2, Validity::Saturated), []);
    assert_eq!(quarter(3, Validity::Good), []);
    let frames = quarter(4, Validity::Good);
    let [Frame { tick: 1, missing: 0, sample }] = frames[..] else { panic!("{frames:?}") };
    // Means of 1 to 4, rounded down; the remainder of 2.5 goes into the next step.
    assert_eq!(sample.specific_force, [2, 5, 7].map(SpecificForce));
    assert_eq!(sample.angular_rate, [10, 12, 15].map(AngularRate));
    assert_eq!((sample.time, sample.validity), (Micros(10_000), Validity::Saturated));
    assert_eq!(sample.temperature, Some(CentiCelsius(4)));
    (5..8).for_each(|k| assert_eq!(quarter(k, Validity::Good), []));
    let next = quarter(8, Validity::Good)[0].sample;
    assert_eq!((next.specific_force[0], next.validity), (SpecificForce(7), Validity::Good));
}

#[test]
fn gaps_are_counted_up_to_a_second() {
    for missing in 0..=u64::from(MAX_GAP) {
        let mut aligner = begun(0);
        let tick = missing as u32 + 1;
        assert_eq!(place(&mut aligner, (missing + 1) * PERIOD_US), Ok((tick, missing as u32)));
        assert_eq!(place(&mut aligner, (missing + 2) * PERIOD_US), Ok((tick + 1, 0)));
    }
}

#[test]
fn a_lost_sample_costs_the_steps_that_it_would_have_covered() {
    for (hz, lost, missing) in [(50, 1, 2), (80, 1, 1), (200, 1, 0), (200, 3, 1), (1000, 4, 0), (1000, 16, 1)]
    {
        let period = 1_000_000 / hz;
        let mut aligner = Aligner::START;
        let counted = (0..4 * hz).filter(|k| !(2 * hz..2 * hz + lost).contains(k)).map(|k| {
            let frames = steps(&mut aligner, sample(k * period, 5)).unwrap();
            if k < hz { 0 } else { frames.iter().map(|frame| frame.missing).sum() }
        });
        assert_eq!(counted.sum::<u32>(), missing, "{hz} Hz, {lost} lost");
    }
}

#[test]
fn rates_that_are_not_used_are_named_and_left_again() {
    let mut aligner = Aligner::START;
    let mut time = 0;
    for (period, is_used) in [
        (*PERIODS_US.start(), true),
        (PERIODS_US.start() - 1, false),
        (10_000, true),
        (*PERIODS_US.end(), true),
        (PERIODS_US.end() + 1, false),
        (100_000, false),
        (2_500, true),
    ] {
        let mut newest = Ok(Vec::new());
        for _ in 0..100 {
            time += period;
            newest = steps(&mut aligner, sample(time, 1));
        }
        let error = AlignError::Rate { period_us: period };
        assert_eq!(newest.as_ref().err(), (!is_used).then_some(&error), "{period} us");
        // Their time is missing from the steps, not from the grid.
        if let Some(step) = newest.iter().flatten().last() {
            let due = (time - PERIODS_US.start()) / PERIOD_US;
            assert!(u64::from(step.tick).abs_diff(due) <= 1, "{period} us: {} for {due}", step.tick);
        }
    }
}

#[test]
fn no_step_holds_samples_of_before_and_after_a_rate_that_is_not_used() {
    let (mut aligner, mut time, mut means) = (Aligner::START, 0, Vec::new());
    for (period, samples, rate) in [(2_500, 103, 1_000), (30_000, 40, 0), (2_500, 100, 3_000)] {
        for _ in 0..samples {
            time += period;
            let frames = steps(&mut aligner, sample(time, rate)).unwrap_or_default();
            means.extend(frames.iter().map(|frame| frame.sample.angular_rate[2].0).filter(|_| rate == 3_000));
        }
    }
    assert!(means.len() > 10 && means.iter().all(|mean| *mean == 3_000), "{means:?}");
}

#[test]
fn duplicates_and_steps_back_leave_the_grid() {
    let mut aligner = begun(2_000_000);
    let (last, at) = (Micros(2_000_000), Micros(1_990_000));
    assert_eq!(place(&mut aligner, 2_000_000), Err(AlignError::Duplicate { at: last }));
    assert_eq!(place(&mut aligner, 1_990_000), Err(AlignError::Backwards { last, at }));
    assert_eq!(place(&mut aligner, 1_000_000), Err(AlignError::Backwards { last, at: Micros(1_000_000) }));
    assert_eq!(place(&mut aligner, 2_010_000), Ok((1, 0)));
}

#[test]
fn a_jump_starts_a_new_grid() {
    for to in [0, 1, 3_999_999, 6_020_000, 100_000_000, 1 << 61] {
        let mut aligner = begun(4_000_000 + 1_000_000);
        let error = AlignError::Jump { last: Micros(5_000_000), at: Micros(to) };
        assert_eq!(place(&mut aligner, to), Err(error));
        assert_eq!(place(&mut aligner, to + PERIOD_US), Ok((1, 0)), "after a jump to {to}");
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn a_regular_stream_is_taken_up_again_within_a_second(
        before in prop::collection::vec(any::<u64>(), 1..20),
        near in prop::collection::vec(0u64..10_000_000, 1..20),
        start in 0u64..10_000_000,
        period in *PERIODS_US.start()..=*PERIODS_US.end(),
    ) {
        let mut aligner = Aligner::START;
        for time in before.into_iter().chain(near) {
            let _ = steps(&mut aligner, sample(time, 1));
        }
        // At worst it begins a second before the last sample.
        let stream = (0..3_000_000 / period).map(|k| steps(&mut aligner, sample(start + k * period, 1)).is_ok());
        let taken: Vec<bool> = stream.collect();
        let second = (1_000_000 / period) as usize + 9;
        prop_assert!(taken[second..].iter().all(|taken| *taken), "{:?}", taken);
    }
}

/// At 400 Hz a step has four samples; of jitter the next one may come early.
#[test]
fn a_caller_is_told_before_the_sample_that_completes_a_step() {
    let mut aligner = Aligner::START;
    assert!(aligner.is_nearly_complete(), "the first sample is a step");
    (0..=40).for_each(|k| drop(steps(&mut aligner, sample(k * 2_500, 0))));
    for (after, is_nearly) in [(2_500, false), (5_000, false), (7_400, true), (10_000, false)] {
        steps(&mut aligner, sample(100_000 + after, 0)).expect("used");
        assert_eq!(aligner.is_nearly_complete(), is_nearly, "{after} us after the step");
    }
}
