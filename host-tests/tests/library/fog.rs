//! FoGNet's corrections on the way out: seconds, windows, the rule and its exact sum.

use gyronet::fog::{FogConfig, FogCorrector, FogOutput, IncrementRate};
use gyronet::model::fognet::FogEstimate;
use gyronet::model::seconds::{
    FogFrame, Incomplete, Minute, NewSecond, STEPS, Second, SecondSums, SecondsWindow,
};
use gyronet::units::{Angle, AngularRate, WheelSpeed};
use gyronet_host_tests::noise::Noise;

/// 1e-3 rad.
const MILLIRADIAN: i64 = (1 << Angle::FRACTION_BITS) / 1000;
const Q31: f64 = (1u32 << 31) as f64;

fn frame(turn: i64) -> FogFrame {
    FogFrame { turn: Some(Angle(turn)), inertial: Some([0; 6]), wheels: Some([WheelSpeed(0); 2]) }
}

/// A correction of `spread` that no increment explains, and a scale error of `gain`.
fn estimate(spread: i64, linear: i64, gain: f64) -> FogEstimate {
    FogEstimate {
        correction: Angle(spread + linear),
        linear: Angle(linear),
        gain: (gain * Q31) as i32,
        clamped_inputs: 0,
    }
}

/// Runs frames, and hands the same estimate back for every window `after` frames later.
fn run(corrector: &mut FogCorrector, turns: &[i64], given: FogEstimate, after: usize) -> Vec<FogOutput> {
    let mut due = None;
    turns
        .iter()
        .enumerate()
        .map(|(n, turn)| {
            let output = corrector.correct(&frame(*turn));
            if let Some(second) = output.due {
                due = Some((n + after, second.number));
            }
            if let Some((at, number)) = due
                && n >= at
            {
                corrector.deliver(number, given);
                due = None;
            }
            output
        })
        .collect()
}

fn sum(outputs: &[FogOutput], of: impl Fn(&FogOutput) -> Option<Angle>) -> i64 {
    outputs.iter().filter_map(of).map(|angle| angle.0).sum()
}

#[test]
fn a_second_sums_increments_and_averages_the_rest() {
    let mut sums = SecondSums::ZERO;
    let mut noise = Noise::new(3);
    let mut total = 0;
    for n in 0..100 {
        let turn = noise.int(-1 << 40, 1 << 40);
        total += turn;
        let given = FogFrame {
            turn: Some(Angle(turn)),
            // Every other frame only: 50 of them, 3 and 4 in turn, whose mean is 3.5.
            inertial: (n % 2 == 0).then_some([1, -1, i32::MAX, i32::MIN, 3 + n / 2 % 2, 0]),
            wheels: Some([WheelSpeed(n), WheelSpeed(-n)]),
        };
        let second = sums.add(&given).expect("nothing is missing");
        assert_eq!(second.is_some(), n == 99);
        let Some(second) = second else { continue };
        assert_eq!(second.turn, Angle(total));
        // 49.5 and -49.5 go to the nearest code upwards.
        assert_eq!(second.features, [1, -1, i32::MAX, i32::MIN, 4, 0, 50, -49]);
    }
}

#[test]
fn a_second_needs_half_of_the_inertial_samples_and_of_the_wheels() {
    let silent = |inertial, wheels| {
        let mut sums = SecondSums::ZERO;
        let judged = (0..100).map(|n| {
            let mut given = frame(1);
            given.inertial = given.inertial.filter(|_| n < inertial);
            given.wheels = given.wheels.filter(|_| n < wheels);
            sums.add(&given)
        });
        judged.last().expect("there are a hundred")
    };
    assert!(matches!(silent(50, 50), Ok(Some(_))));
    assert_eq!(silent(49, 100), Err(Incomplete::Inertial));
    assert_eq!(silent(100, 49), Err(Incomplete::Wheels));
}

fn turns(window: &SecondsWindow<'_>) -> Vec<i64> {
    window.iter().map(|second| second.turn.0).collect()
}

#[test]
fn a_window_repeats_its_seconds_until_a_minute_is_over() {
    let mut minute = Minute::EMPTY;
    assert!(minute.window().is_none());
    for n in 0..130i64 {
        minute.add(Second { features: [0; 8], turn: Angle(n) });
        let have = n + 1;
        let newest = (have - STEPS as i64)..have;
        let expected: Vec<i64> =
            newest.map(|row| if have < 60 { row.rem_euclid(have) } else { row }).collect();
        assert_eq!(minute.window().as_ref().map(turns), Some(expected), "{have} s");
    }
}

#[test]
fn a_second_that_was_missed_and_a_gap_begin_a_new_window() {
    let mut minute = Minute::EMPTY;
    let mut follow = |number: u32, is_first| {
        let second = Second { features: [0; 8], turn: Angle(number.into()) };
        turns(&minute.follow(NewSecond { number, is_first, second }))[..3].to_vec()
    };
    assert_eq!(follow(5, false), [5, 5, 5]);
    assert_eq!(follow(6, false), [5, 6, 5]);
    assert_eq!(follow(8, false), [8, 8, 8], "7 was missed");
    assert_eq!(follow(9, true), [9, 9, 9], "a gap");
}

#[test]
fn the_sum_of_the_turns_is_exact() {
    let mut noise = Noise::new(8);
    for (spread, gain) in [(3 * MILLIRADIAN + 1, 0.0), (-MILLIRADIAN, 0.001), (7, -0.0123), (0, 0.5)] {
        let turns: Vec<i64> = (0..30_000).map(|_| noise.int(-1 << 39, 1 << 39)).collect();
        let mut corrector = FogCorrector::new(FogConfig::DEFAULT);
        let given = estimate(spread, 12_345, gain);
        let outputs = run(&mut corrector, &turns, given, 10);
        for (output, turn) in outputs.iter().zip(&turns) {
            assert_eq!(output.turn.expect("no gap").0 + output.correction.0, *turn);
        }
        // The first second ends with frame 99, its estimate is in use from frame 200 on.
        let used = outputs.iter().position(|output| output.corrected).expect("it was");
        assert_eq!(used, 200);
        // The scale error goes with the turn, and the rest evenly.
        for (output, turn) in outputs.iter().zip(&turns).skip(used) {
            let due = i128::from(spread / 6000) + ((i128::from(*turn) * i128::from(given.gain)) >> 31);
            assert!((i128::from(output.correction.0) - due).abs() <= 2, "{output:?}");
        }
        let turned: i128 = turns[used..].iter().map(|turn| i128::from(*turn)).sum();
        let linear = turned * i128::from(given.gain);
        let constant = i128::from(spread) * (turns.len() - used) as i128;
        let taken = i128::from(sum(&outputs, |output| Some(output.correction)));
        // Both remainders are less than one code.
        assert!((taken - (linear >> 31) - constant / 6000).abs() <= 2, "{taken}");
    }
}

#[test]
fn the_speed_of_the_network_changes_no_turn() {
    let turns: Vec<i64> = (0..1_000).map(|n| n << 30).collect();
    let run = |after| {
        run(&mut FogCorrector::new(FogConfig::DEFAULT), &turns, estimate(MILLIRADIAN, 0, 0.01), after)
    };
    let at_once = run(0);
    assert_eq!(at_once, run(99));
    assert!(at_once.iter().skip(200).all(|output| output.corrected && !output.late));
    // One frame more is too late, and said.
    let late = run(100);
    assert!(late.iter().all(|output| !output.corrected));
    assert_eq!(late.iter().filter(|output| output.late).count(), 9);
}

#[test]
fn a_gap_ends_the_window_and_the_estimate() {
    let mut corrector = FogCorrector::new(FogConfig::DEFAULT);
    let given = estimate(MILLIRADIAN, 0, 0.0);
    assert!(run(&mut corrector, &[0; 450], given, 0)[449].corrected);
    let output = corrector.correct(&FogFrame { turn: None, ..frame(0) });
    assert_eq!((output.turn, output.broken, output.corrected), (None, Some(Incomplete::Gyro), false));
    // The estimate of a window from before the gap is refused.
    corrector.deliver(3, given);
    let after = run(&mut corrector, &[0; 450], given, 0);
    assert_eq!(after.iter().position(|output| output.corrected), Some(200));
    assert!(after.iter().all(|output| !output.late));
    let first: Vec<_> = after.iter().filter_map(|output| output.due).map(|second| second.is_first).collect();
    assert_eq!(first, [true, false, false, false]);
}

#[test]
fn an_implausible_correction_is_not_used() {
    let FogConfig { max_correction: Angle(max), .. } = FogConfig::DEFAULT;
    for (correction, believed) in [(max, true), (-max, true), (max + 1, false), (i64::MIN, false)] {
        let mut corrector = FogCorrector::new(FogConfig::DEFAULT);
        let outputs = run(&mut corrector, &[0; 300], estimate(correction, 0, 0.0), 0);
        let said = outputs[199].implausible.map(|implausible| implausible.correction.0);
        assert_eq!(said, (!believed).then_some(correction));
        assert_eq!(outputs[299].corrected, believed);
    }
}

#[test]
fn rates_lose_nothing() {
    let mut noise = Noise::new(4);
    let mut to_rate = IncrementRate::default();
    let (mut turned, mut rates) = (0i64, 0i64);
    for _ in 0..100_000 {
        let turn = noise.int(-1 << 40, 1 << 40);
        let AngularRate(rate) = to_rate.rate(Angle(turn));
        turned += turn;
        rates += i64::from(rate);
        // A rate code for 10 ms is 2^17 / 100 angle codes.
        assert!((turned * 100 - (rates << 17)).abs() < 1 << 17);
    }
}
