//! Dead reckoning: the paper's equations, and the board's integers against f64.

use gyronet::odometry::{Odometry, Track};
use gyronet::units::{Angle, AngularRate, Length, WheelSpeed};
use gyronet_host_tests::noise::{Noise, cases};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Returns the errors of the board, position in m and heading in rad, and the bounds that it states.
fn compare(steps: impl IntoIterator<Item = ([WheelSpeed; 2], AngularRate, u32)>) -> [(f64, f64); 2] {
    let (mut board, mut exact) = (Odometry::default(), Track::default());
    let (mut way, mut count, mut worst) = (0.0, 0.0, [0.0f64; 2]);
    let (mut bound, mut heading_bound) = (0.0, 0.0);
    for (wheels, rate, span) in steps {
        let seconds = f64::from(span) * 1e-6;
        let metres = wheels.map(|speed| speed.metre_per_sec() * seconds);
        board.step(wheels, rate, span);
        exact.step(metres, rate.rad_per_sec() * seconds);
        way += ((metres[0] + metres[1]) / 2.0).abs();
        count += 1.0;
        let off = [0, 1].map(|axis| board.position[axis].metre() - exact.position[axis]);
        worst[0] = worst[0].max((off[0] * off[0] + off[1] * off[1]).sqrt());
        worst[1] = worst[1].max((board.yaw.rad() - exact.yaw).abs());
        bound = Odometry::ERROR_PER_METRE * way + Odometry::ERROR_PER_STEP_M * count;
        // f64 itself rounds sums of some hundred rad.
        heading_bound = Odometry::HEADING_ERROR_PER_STEP_RAD * count + 1e-13 * count;
    }
    [(worst[0], bound), (worst[1], heading_bound)]
}

#[test]
fn straight_lines_and_circles_end_where_they_must() {
    let mut track = Track::default();
    (0..100).for_each(|_| track.step([0.1, 0.1], 0.0));
    assert!((track.position[0] - 10.0).abs() < 1e-12 && track.position[1] == 0.0);
    // A circle of 10 m radius to the left, in 0.01 rad steps: each is the chord of an arc, which
    // the heading in the middle of the step makes exact in direction.
    let mut track = Track::default();
    let arc = 10.0 * 0.01;
    (0..157).for_each(|_| track.step([arc; 2], 0.01));
    let angle: f64 = 1.57;
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    assert!((track.position[0] - 10.0 * sin).abs() < 1e-4);
    assert!((track.position[1] - 10.0 * (1.0 - cos)).abs() < 1e-4);
}

#[test]
fn wheels_are_averaged() {
    let mut track = Track::default();
    track.step([1.0, 3.0], FRAC_PI_2 * 2.0);
    assert!(track.position[0].abs() < 1e-15 && (track.position[1] - 2.0).abs() < 1e-15);
    assert_eq!(track.yaw, FRAC_PI_2 * 2.0);
}

/// An hour of a town at 100 Hz.
#[test]
fn an_hour_on_the_board_stays_within_its_stated_error() {
    let mut noise = Noise::new(7);
    let (mut speed, mut rate) = (10.0, 0.0);
    let steps = (0..360_000).map(|_| {
        speed = f64::clamp(speed + 0.02 * noise.normal(), 0.0, 25.0);
        rate = 0.995 * rate + 0.01 * noise.normal();
        let code = |metres: f64| WheelSpeed((metres * 65_536.0) as i32);
        let yaw_rate = AngularRate((rate * f64::from(AngularRate::PER_RAD_PER_SEC)) as i32);
        ([code(speed - 0.7 * rate), code(speed + 0.7 * rate)], yaw_rate, 10_000)
    });
    let [(metres, bound), (heading, heading_bound)] = compare(steps);
    println!("after an hour: {metres:.2e} m (bound {bound:.2e}), {heading:.1e} rad");
    assert!(metres <= bound && heading <= heading_bound);
    assert!(bound < 0.03, "an hour at 10 m/s is within 3 cm");
}

#[test]
fn the_limits_of_the_codes_do_no_harm() {
    let mut board = Odometry { position: [Length(i64::MAX), Length(i64::MIN)], yaw: Angle(i64::MAX) };
    for _ in 0..3 {
        board.step([WheelSpeed(i32::MAX); 2], AngularRate(i32::MAX), u32::MAX);
        board.step([WheelSpeed(i32::MIN); 2], AngularRate(i32::MIN), u32::MAX);
    }
}

#[test]
fn many_turns_are_as_one() {
    let (mut board, turn) = (Odometry::default(), Angle((TAU * f64::from(Angle::PER_RAD)) as i64));
    for _ in 0..1_000 {
        board.advance(Length(0), turn);
    }
    board.advance(Length(1 << 40), Angle(0));
    assert!((board.position[0].metre() - 256.0).abs() < 1e-3, "{}", board.position[0].metre());
    assert!(board.position[1].metre().abs() < 1e-3);
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn the_bound_holds(
        steps in prop::collection::vec(
            (-6_000_000i32..6_000_000, -6_000_000i32..6_000_000, any::<i32>(), 1u32..50_000),
            1..300,
        ),
    ) {
        let steps = steps.into_iter().map(|(left, right, rate, span)| {
            ([WheelSpeed(left), WheelSpeed(right)], AngularRate(rate), span)
        });
        let [(metres, bound), (heading, heading_bound)] = compare(steps);
        prop_assert!(metres <= bound, "{metres} {bound}");
        prop_assert!(heading <= heading_bound, "{heading} {heading_bound}");
    }
}
