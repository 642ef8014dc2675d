//! The judge of standstill: what each source proves, and what contradicts it.

use gyronet::sample::{ImuSample, Standstill, WHEELS, WheelSample};
use gyronet::standstill::{Judge, Standing, StandstillSource};
use gyronet::units::{AngularRate, WheelSpeed};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{force, rate, turning};

/// A vehicle whose road shakes it below 2 Hz, and whose engine shakes it at 27 Hz.
struct Vehicle {
    judge: Judge,
    noise: Noise,
    road: f64,
    tick: u64,
}

impl Vehicle {
    fn new() -> Self {
        Self { judge: Judge::START, noise: Noise::new(11), road: 0.0, tick: 0 }
    }

    /// The judgement after seconds with this shake by the road, rad/s, and forward acceleration, m/s^2.
    fn go(&mut self, seconds: f64, shake: f64, ahead: f64, wheels: Option<&WheelSample>) -> Standing {
        let mut standing = Standing::UNKNOWN;
        for _ in 0..(100.0 * seconds) as u64 {
            let sample = self.sample(shake, ahead);
            standing = self.judge.observe(&sample, wheels);
        }
        standing
    }

    fn sample(&mut self, shake: f64, ahead: f64) -> ImuSample {
        self.tick += 1;
        self.road += 0.1 * (self.noise.normal() - self.road);
        let engine = (std::f64::consts::TAU * 0.27 * self.tick as f64).sin();
        let mut sample = turning(self.tick, AngularRate(0));
        for axis in 0..3 {
            sample.angular_rate[axis] = rate(0.006 * engine + 4.0 * shake * self.road);
            sample.specific_force[axis].0 += force(0.2 * engine + 60.0 * shake * self.road).0;
        }
        sample.specific_force[0].0 += force(ahead).0;
        sample
    }
}

fn wheels(speed: f64, standstill: Standstill) -> WheelSample {
    let speeds = [Some(WheelSpeed((65_536.0 * speed) as i32)); WHEELS];
    WheelSample { speeds, ..WheelSample::without_speeds(standstill) }
}

#[test]
fn quiet_after_braking_is_a_stop_and_a_smooth_road_is_none() {
    for (braking, stops) in [(-1.5, true), (0.0, false)] {
        let mut car = Vehicle::new();
        car.go(20.0, 0.02, 0.0, None);
        assert_eq!(car.go(3.0, 0.02, braking, None), Standing::UNKNOWN);
        let standing = car.go(4.0, 0.0, 0.0, None);
        assert_eq!((standing.is_likely(), standing.is_lasting()), (stops, stops), "{standing:?}");
        let lasting = car.go(10.0, 0.0, 0.0, None);
        assert!(lasting.is_lasting() && lasting.is_likely() == stops, "{lasting:?}");
        // It pulls away on the smooth road.
        let moving = car.go(1.0, 0.0, 1.0, None);
        assert_eq!(moving, Standing::UNKNOWN);
    }
}

/// A vehicle that creeps at its wheels' threshold has no more driven off than one whose wheels stand.
#[test]
fn wheels_faster_than_a_creep_show_that_a_vehicle_drives_off() {
    let moving = |speed| wheels(speed, Standstill::Moving);
    let bare = WheelSample::without_speeds(Standstill::Moving);
    for (report, drives) in
        [(moving(0.03), false), (moving(0.3), false), (moving(0.9), false), (moving(1.0), true), (bare, true)]
    {
        let mut car = Vehicle::new();
        car.go(5.0, 0.0, 0.0, Some(&report));
        assert_eq!(car.judge.has_driven_off(), drives, "{report:?}");
    }
}

#[test]
fn one_wheel_that_turns_is_motion() {
    let mut report = wheels(0.0, Standstill::Still);
    report.speeds[2] = Some(WheelSpeed(65_536));
    assert_eq!(Vehicle::new().go(10.0, 0.0, 0.0, Some(&report)), Standing::UNKNOWN);
}

#[test]
fn wheels_frozen_at_zero_prove_nothing_on_the_road() {
    let (mut car, frozen) = (Vehicle::new(), wheels(0.0, Standstill::Still));
    assert_eq!(car.go(1.0, 0.0, 0.0, Some(&frozen)), Standing::WHEELS);
    let standing = car.go(20.0, 0.008, 0.0, Some(&frozen));
    assert!(standing.is_contradicted && standing.source == StandstillSource::None, "{standing:?}");
    // Whoever loads a van shakes it for a while.
    assert_eq!(car.go(5.0, 0.0, 0.0, Some(&frozen)), Standing::WHEELS);
}

#[test]
fn wheels_that_stop_faster_than_a_vehicle_can_brake_are_locked() {
    for (seconds, locked) in [(0.1, true), (2.0, false)] {
        let mut car = Vehicle::new();
        car.go(5.0, 0.02, 0.0, Some(&wheels(15.0, Standstill::Moving)));
        car.go(seconds, 0.02, -7.5, Some(&wheels(0.1, Standstill::Unknown)));
        let standing = car.go(0.1, 0.02, 0.0, Some(&wheels(0.0, Standstill::Still)));
        assert_eq!(standing.is_contradicted, locked, "{seconds} s: {standing:?}");
    }
}

#[test]
fn wheels_show_whether_quiet_can_be_trusted_on_this_vehicle() {
    let (moving, silent) =
        (wheels(20.0, Standstill::Moving), WheelSample::without_speeds(Standstill::Unknown));
    for (seconds, trusted) in [(1.0, true), (60.0, false)] {
        let mut car = Vehicle::new();
        car.go(seconds, 0.0, 0.0, Some(&moving));
        let standing = car.go(3.0, 0.0, 0.0, Some(&silent));
        assert_eq!(standing.is_likely(), trusted, "quiet in motion for {seconds} s: {standing:?}");
    }
}

/// A car on a carrier, or frames frozen at zero: smooth, but for the force.
#[test]
fn wheels_that_stand_while_the_vehicle_speeds_up_prove_nothing_until_they_turn() {
    let (mut car, stands) = (Vehicle::new(), wheels(0.0, Standstill::Still));
    assert_eq!(car.go(8.0, 0.0, 0.0, Some(&stands)), Standing::WHEELS);
    assert!(car.go(2.0, 0.0, 0.8, Some(&stands)).is_contradicted);
    assert!(car.go(20.0, 0.0, 0.0, Some(&stands)).is_contradicted, "quiet is not enough");
    car.go(5.0, 0.02, 0.0, Some(&wheels(5.0, Standstill::Moving)));
    assert_eq!(car.go(5.0, 0.0, 0.0, Some(&stands)), Standing::WHEELS);
}

/// Passive wheel sensors show zero below 0.76 m/s, while the vehicle brakes.
#[test]
fn wheels_that_stand_before_the_braking_ends_are_believed_after_it() {
    let (stands, drives) = (wheels(0.0, Standstill::Still), wheels(1.0, Standstill::Moving));
    let mut car = Vehicle::new();
    car.go(5.0, 0.0, 0.0, Some(&stands));
    car.go(5.0, 4e-3, 0.5, Some(&drives));
    car.go(3.0, 4e-3, -2.0, Some(&drives));
    car.go(0.7, 0.0, -1.2, Some(&stands));
    for _ in 0..100 {
        assert_eq!(car.go(0.1, 0.0, 0.0, Some(&stands)), Standing::WHEELS);
    }
}

#[test]
fn quiet_after_speeding_up_is_no_stop() {
    let mut car = Vehicle::new();
    assert!(car.go(8.0, 0.0, 0.0, None).is_likely());
    car.go(6.0, 0.0, 1.5, None);
    assert!(!car.go(6.0, 0.0, 0.0, None).is_likely(), "it drives on");
    car.go(4.0, 0.0, -2.0, None);
    assert!(car.go(5.0, 0.0, 0.0, None).is_likely(), "it stands");
}
