//! FoGNet's corrections on the way out: seconds, windows, the rule and its exact sum.

use gyronet::fog::{FogCorrector, FogOutput, IncrementRate, MAX_CORRECTION};
use gyronet::model::fognet::{FogEstimate, MinuteNetwork};
use gyronet::model::seconds::{FogFrame, Incomplete, Minute, STEPS, Second, SecondSums, SecondsWindow};
use gyronet::units::{Angle, AngularRate, WheelSpeed};
use gyronet_host_tests::noise::Noise;

/// 1e-3 rad.
const MILLIRADIAN: i64 = (1 << Angle::FRACTION_BITS) / 1000;
const Q31: f64 = (1u32 << 31) as f64;

fn frame(turn: i64) -> FogFrame {
    FogFrame { turn: Angle(turn), inertial: Some([0; 6]), wheels: [WheelSpeed(0); 2] }
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

/// The same estimate for every window.
struct Given(FogEstimate);

impl MinuteNetwork for Given {
    fn estimate(&mut self, _window: &SecondsWindow<'_>) -> FogEstimate {
        self.0
    }
}

fn run(corrector: &mut FogCorrector, turns: &[i64], given: FogEstimate) -> Vec<FogOutput> {
    turns.iter().map(|turn| corrector.correct(&frame(*turn), &mut Given(given))).collect()
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
            turn: Angle(turn),
            // Every other frame only: 50 of them, 3 and 4 in turn, whose mean is 3.5.
            inertial: (n % 2 == 0).then_some([1, -1, i32::MAX, i32::MIN, 3 + n / 2 % 2, 0]),
            wheels: [WheelSpeed(n), WheelSpeed(-n)],
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
fn a_second_needs_half_of_the_inertial_samples() {
    let silent = |inertial| {
        let mut sums = SecondSums::ZERO;
        let judged = (0..100).map(|n| {
            let given = frame(1);
            sums.add(&FogFrame { inertial: given.inertial.filter(|_| n < inertial), ..given })
        });
        judged.last().expect("there are a hundred")
    };
    assert!(matches!(silent(50), Ok(Some(_))));
    assert_eq!(silent(49), Err(Incomplete));
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
fn the_sum_of_the_turns_is_exact() {
    let mut noise = Noise::new(8);
    for (spread, gain) in [(3 * MILLIRADIAN + 1, 0.0), (-MILLIRADIAN, 0.001), (7, -0.0123), (0, 0.5)] {
        let turns: Vec<i64> = (0..30_000).map(|_| noise.int(-1 << 39, 1 << 39)).collect();
        let given = estimate(spread, 12_345, gain);
        let outputs = run(&mut { FogCorrector::START }, &turns, given);
        for (output, turn) in outputs.iter().zip(&turns) {
            assert_eq!(output.turn.0 + output.correction.0, *turn);
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
        let taken = outputs.iter().map(|output| i128::from(output.correction.0)).sum::<i128>();
        // Both remainders are less than one code.
        assert!((taken - (linear >> 31) - constant / 6000).abs() <= 2, "{taken}");
    }
}

#[test]
fn a_gap_ends_the_window_and_the_estimate() {
    let mut corrector = FogCorrector::START;
    let given = estimate(MILLIRADIAN, 0, 0.0);
    assert!(run(&mut corrector, &[0; 450], given)[449].corrected);
    let silent = FogFrame { inertial: None, ..frame(0) };
    // The first of the two seconds has half of its inertial samples.
    let broken = (0..150).position(|_| corrector.correct(&silent, &mut Given(given)).broken);
    assert_eq!(broken, Some(149));
    /// Wants windows without the seconds of before the gap.
    struct Short;
    impl MinuteNetwork for Short {
        fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
            assert!(window.iter().all(|second| second.turn == Angle(100)));
            FogEstimate::NONE
        }
    }
    let after = (0..450).position(|_| corrector.correct(&frame(1), &mut Short).corrected);
    assert_eq!(after, Some(200));
}

#[test]
fn an_implausible_correction_is_not_used() {
    let Angle(max) = MAX_CORRECTION;
    for (correction, believed) in [(max, true), (-max, true), (max + 1, false), (i64::MIN, false)] {
        let outputs = run(&mut { FogCorrector::START }, &[0; 300], estimate(correction, 0, 0.0));
        assert_eq!((outputs[199].implausible, outputs[299].corrected), (!believed, believed));
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
