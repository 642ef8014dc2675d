//! The expected error of a rate: vectors worked out by hand. How often recorded errors lie inside it is a test of the
//! tools (`expected_error`).

use gyronet::bias::STATIC_SAMPLES;
use gyronet::estimate::Missed;
use gyronet::pipeline::{BoardState, Pipeline, PipelineConfig};
use gyronet::pipeline::{GyroErrors, Origin, Turning, Uncertainty, UncertaintyConfig};
use gyronet::sample::ImuSample;
use gyronet::units::AngularRate;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{force, idling, rate};

/// One part in a million, and the code that rounding up adds: f32's own error.
fn assert_sigma(found: AngularRate, rad_per_sec: f64, why: &str) {
    let (found, code) = (found.rad_per_sec(), AngularRate(1).rad_per_sec());
    let beyond = found - rad_per_sec;
    assert!(
        (-1e-6 * rad_per_sec..=1e-6 * rad_per_sec + code).contains(&beyond),
        "{why}: {found:e} is not {rad_per_sec:e}"
    );
}

/// 2.5e-4 rad/s are 51 deg/h; 2.5, 6 and 6.5 are like 3, 4 and 5, since the parts are independent.
#[test]
fn a_rate_that_the_network_corrects_has_less_noise_and_a_bias_adds_in_squares() {
    let uncertainty = Uncertainty::new(UncertaintyConfig::DEFAULT);
    for (origin, bias, due) in
        [(Origin::Network, 0.0, 1.7e-4), (Origin::Gyro, 0.0, 2.5e-4), (Origin::Gyro, 6e-4, 6.5e-4)]
    {
        assert_sigma(uncertainty.sigma(origin, bias), due, "at rest");
    }
    // It is rounded up and ends with its code.
    let uncorrected = 1.5 / AngularRate::PER_RAD_PER_SEC;
    let rounded = Uncertainty::new(UncertaintyConfig { uncorrected, ..UncertaintyConfig::DEFAULT });
    assert_eq!([0.0, 1e9].map(|bias| rounded.sigma(Origin::Gyro, bias).0), [2, i32::MAX]);
}

/// Errors that are easy to tell apart.
const ERRORS: UncertaintyConfig = UncertaintyConfig {
    noise: 3e-4,
    uncorrected: 3e-4,
    unknown: GyroErrors { gain: 0.01, mounting: 0.02, model: 0.5 },
    known: GyroErrors { gain: 0.001, mounting: 0.002, model: 0.0 },
};

/// Adds seconds of constant rates about x, y, z and of a rate that standstill hides; its bias has a sigma of 1e-4 rad/s.
fn turn(uncertainty: &mut Uncertainty, seconds: f64, [x, y, z, hidden]: [f64; 4]) {
    let origin = if hidden == 0.0 { Origin::Gyro } else { Origin::Standstill };
    let (estimate, withheld) = (rate(0.0), rate(hidden));
    let turning = Turning { rates: [x, y, z].map(rate), estimate, withheld, origin, bias: 1e-4 };
    for _ in 0..(seconds * 100.0).round() as u32 {
        uncertainty.add(&turning);
    }
}

fn assert_ratio(found: f64, due: f64, within: f64) {
    assert!((found / due - 1.0).abs() < within, "{found} is not {due}");
}

fn root(squares: &[f64]) -> f64 {
    squares.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// A rate that a network corrects by this much, and nothing else.
fn corrected(estimate: f64) -> Turning {
    let [none, estimate] = [0.0, estimate].map(rate);
    Turning { rates: [none; 3], estimate, withheld: none, origin: Origin::Network, bias: 0.0 }
}

/// Half of what the network takes off for ten seconds may be wrong, unless the unit is calibrated.
#[test]
fn a_lasting_correction_may_be_another_unit_s() {
    for (calibrated, share) in [(false, 0.5), (true, 0.0)] {
        let mut uncertainty = Uncertainty::new(ERRORS);
        uncertainty.calibrated(calibrated);
        (0..999).for_each(|_| uncertainty.add(&corrected(-2e-3)));
        let due = root(&[3e-4, share * 2e-3]);
        assert_ratio(uncertainty.sigma(Origin::Network, 0.0).rad_per_sec(), due, 2e-3);
        let due = root(&[3e-4 * 9.99f64.sqrt(), share * 19.98e-3]);
        assert_ratio(uncertainty.minute(Missed::NOTHING).into(), due, 1e-4);
    }
}

/// What a turn shows of itself in the correction is at most 3 % of it, and on a straight road nothing.
#[test]
fn four_tenths_of_the_correction_in_a_bend_may_be_the_bend_s_own() {
    let sigma = |turns: f64, estimate: f64| {
        let mut uncertainty = Uncertainty::new(ERRORS);
        uncertainty.calibrated(true);
        let [none, z] = [0.0, turns].map(rate);
        (0..100).for_each(|_| uncertainty.add(&Turning { rates: [none, none, z], ..corrected(estimate) }));
        uncertainty.sigma(Origin::Network, 0.0)
    };
    assert_sigma(sigma(0.1, 2e-3), root(&[3e-4, 8e-4, 1e-4]), "a share of it");
    assert_sigma(sigma(0.1, 2e-2), root(&[3e-4, 3e-3, 1e-4]), "3 % of the turn");
    assert_sigma(sigma(0.0, 2e-3), 3e-4, "straight on");
}

/// A truck at idle: 0.02 rad/s at 9 Hz swing by 2.5e-4 rad RMS at an end of a second that is not known, and seven tenths count.
#[test]
fn what_the_network_takes_off_to_and_fro_may_be_the_vehicle_s_own_shake() {
    let mut uncertainty = Uncertainty::new(UncertaintyConfig { noise: 0.0, ..ERRORS });
    uncertainty.calibrated(true);
    let shake = |step: u32| 0.02 * (f64::from(step) * 0.01 * 9.0 * std::f64::consts::TAU).sin();
    let mut found = Vec::new();
    for step in 0..300 {
        uncertainty.add(&corrected(shake(step)));
        found.push(uncertainty.sigma(Origin::Network, 0.0).rad_per_sec());
    }
    found.drain(..200);
    let [least, most] = [f64::min, f64::max].map(|of| found.iter().copied().reduce(of).expect("a hundred"));
    assert_ratio(least, 0.7 * 2.5e-4, 0.1);
    // Where the second ends at the largest angle.
    assert_ratio(most, 0.7 * 2.5e-4 * 3f64.sqrt(), 0.1);
}

#[test]
fn the_beginning_of_a_turn_counts_in_a_fifth_of_a_second_and_its_end_for_a_second() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    let sigma = |uncertainty: &Uncertainty| uncertainty.sigma(Origin::Gyro, 0.0);
    turn(&mut uncertainty, 3.0, [0.0; 4]);
    assert_sigma(sigma(&uncertainty), 3e-4, "straight");
    turn(&mut uncertainty, 0.2, [0.0, 0.0, 0.5, 0.0]);
    assert_sigma(sigma(&uncertainty), root(&[3e-4, 5e-3]), "a full turn");
    turn(&mut uncertainty, 0.8, [0.0, 0.0, 0.5, 0.0]);
    turn(&mut uncertainty, 0.5, [0.0; 4]);
    assert_sigma(sigma(&uncertainty), root(&[3e-4, 2.5e-3]), "half of the last second");
    turn(&mut uncertainty, 0.5, [0.0; 4]);
    assert_sigma(sigma(&uncertainty), 3e-4, "straight again");
}

#[test]
fn a_rate_that_standstill_hides_may_be_an_error_as_a_whole() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    turn(&mut uncertainty, 1.0, [0.0, 0.0, 0.0, 4e-3]);
    assert_sigma(uncertainty.sigma(Origin::Gyro, 0.0), root(&[3e-4, 4e-3]), "the gyro's own rate");
    // Zero has no noise of its own.
    assert_sigma(uncertainty.sigma(Origin::Standstill, 3e-3), 5e-3, "hidden");
    let mut begins = Uncertainty::new(ERRORS);
    turn(&mut begins, 3.0, [0.0, 0.0, 0.0, 1e-9]);
    turn(&mut begins, 0.2, [0.0, 0.0, 0.0, 4e-3]);
    assert!(begins.sigma(Origin::Standstill, 0.0).rad_per_sec() > 2.5e-3, "a turn that begins");
    turn(&mut uncertainty, 9.0, [0.0, 0.0, 0.0, 4e-3]);
    // The rate counts from its first fifth of a second on.
    assert_ratio(uncertainty.minute(Missed::NOTHING).into(), 9.85 * root(&[4e-3, 1e-4]), 0.02);
}

/// A gyro beside this one is not levelled: on what may be a ramp it misses a share of a turn.
#[test]
fn a_tilt_that_one_standstill_has_shown_may_be_a_ramp_to_a_gyro_beside() {
    let mut pipeline = Pipeline::new(PipelineConfig::DEFAULT);
    let mut noise = Noise::new(1);
    for tick in 0..u64::from(STATIC_SAMPLES) + 5 {
        let specific_force = [2.04, 0.0, 9.59].map(force);
        let sample = ImuSample { specific_force, ..idling(tick, 0.001, &mut noise) };
        pipeline.correct(sample, None, &BoardState::GOOD).expect("in time");
    }
    let missed = pipeline.tilted();
    assert!((0.016..0.022).contains(&missed), "1 - cos of 11 degrees: {missed}");
}

/// A tilt that is not taken off adds to a mounting by eye, one that is takes its place; half its square is missed, of which half counts.
#[test]
fn a_tilt_in_use_is_part_of_the_expected_error() {
    for (levelled, mounting) in [(false, root(&[0.02, 0.2])), (true, 0.2)] {
        let mut uncertainty = Uncertainty::new(ERRORS);
        uncertainty.tilt(0.04, levelled);
        turn(&mut uncertainty, 2.0, [0.03, -0.04, 0.5, 0.0]);
        let due = root(&[3e-4, root(&[0.01, 0.02]) * 0.5, mounting * 0.05, 0.5 * 0.005 * 0.5]);
        assert_ratio(uncertainty.sigma(Origin::Gyro, 0.0).rad_per_sec(), due, 1e-4);
    }
    let mut precise = Uncertainty::new(ERRORS);
    precise.tilt(1e-6, true);
    turn(&mut precise, 2.0, [0.3, -0.4, 0.0, 0.0]);
    assert_sigma(precise.sigma(Origin::Gyro, 0.0), root(&[3e-4, 0.002 * 0.5]), "as a calibration");
}

#[test]
fn a_gain_by_courses_counts_where_it_is_better() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    turn(&mut uncertainty, 2.0, [0.0, 0.0, 0.5, 0.0]);
    for (sigma, gain) in [(0.02, 0.01), (0.004, 0.004)] {
        uncertainty.gain(sigma);
        assert_sigma(uncertainty.sigma(Origin::Gyro, 0.0), root(&[3e-4, gain * 0.5]), "the better one");
    }
}

#[test]
fn the_last_second_shows_how_far_the_vehicle_leans_and_a_turn_s_axis() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    turn(&mut uncertainty, 1.0, [0.012, -0.016, 0.1, 0.0]);
    assert!((uncertainty.leaning() - 0.02).abs() < 1e-6, "{}", uncertainty.leaning());
    // 1 - cos of 0.2 rad; 0.1 rad are no turn yet by which the minute could show it.
    assert_eq!(uncertainty.tilted(), 0.0);
    assert!((uncertainty.tilted_now() - 0.02).abs() < 1e-5, "{}", uncertainty.tilted_now());
    turn(&mut uncertainty, 1.0, [0.0, 0.02, 0.04, 0.0]);
    assert_eq!(uncertainty.tilted_now(), 0.0, "too slow a turn to tell");
}

/// Half of what a banked turn may miss adds linearly with the bias.
#[test]
fn a_minute_of_a_banked_turn_misses_the_same_share_throughout() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    turn(&mut uncertainty, 100.0, [0.0, 0.1, 0.5, 0.0]);
    let due = root(&[3e-4 * 60f64.sqrt(), root(&[1e-4, 0.5 * 0.02 * 0.5]) * 60.0, 0.01 * 30.0, 0.02 * 6.0]);
    assert_ratio(uncertainty.minute(Missed::NOTHING).into(), due, 1e-3);
    let tilted = f64::from(uncertainty.tilted());
    assert!((tilted - 0.02).abs() < 1e-5, "{tilted}: 1 - cos of 0.2 rad");
    let due = root(&[3e-4, 0.01 * 0.5, 0.02 * 0.1, 0.5 * 0.02 * 0.5]);
    assert_ratio(uncertainty.sigma(Origin::Gyro, 0.0).rad_per_sec(), due, 1e-5);
}

/// The angles that many gaps leave out of one turn add up.
#[test]
fn gaps_in_one_turn_add_linearly_and_those_in_opposite_turns_cancel() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    let gap = |angle: f32| Missed { angle, variance: 0.0 };
    (0..20).for_each(|_| uncertainty.miss(gap(0.01)));
    assert!((uncertainty.minute(Missed::NOTHING) - 0.2).abs() < 1e-5);
    assert!((uncertainty.minute(gap(0.05)) - 0.25).abs() < 1e-5, "and that of a gap that is still open");
    (0..20).for_each(|_| uncertainty.miss(gap(-0.01)));
    assert!(uncertainty.minute(Missed::NOTHING) < 1e-5);
}

/// Opposite turns cancel their gain error; the errors of bias add, those of seconds average out.
#[test]
fn a_minute_adds_each_error_by_its_rule_and_forgets_older_ones() {
    let mut uncertainty = Uncertainty::new(ERRORS);
    let minute = |uncertainty: &Uncertainty, variance: f32| {
        f64::from(uncertainty.minute(Missed { angle: 0.0, variance }))
    };
    assert_eq!(uncertainty.minute(Missed::NOTHING), 0.0);
    // An open gap; a turn; there and back.
    assert_ratio(minute(&uncertainty, 0.25), 0.5, 1e-3);
    turn(&mut uncertainty, 10.0, [0.0, 0.0, 0.2, 0.0]);
    let noise = |seconds: f64| [3e-4 * seconds.sqrt(), 1e-4 * seconds];
    assert_ratio(minute(&uncertainty, 0.0), root(&[root(&noise(10.0)), 0.01 * 2.0]), 1e-3);
    turn(&mut uncertainty, 10.0, [0.0, 0.0, -0.2, 0.0]);
    assert_ratio(minute(&uncertainty, 0.0), root(&noise(20.0)), 1e-3);
    uncertainty.miss(Missed { angle: 0.0, variance: 0.01 });
    turn(&mut uncertainty, 59.0, [0.0; 4]);
    assert!(minute(&uncertainty, 0.0) > 0.1, "a gap within the minute");
    turn(&mut uncertainty, 6.0, [0.0; 4]);
    // Over a minute later.
    assert_ratio(minute(&uncertainty, 0.0), root(&noise(60.0)), 1e-3);
}
