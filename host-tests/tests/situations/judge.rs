//! The simulation's truth and the judge themselves: a perfect sensor is right, and each promise can be broken.

use gyronet_host_tests::situations::judge::{EXACT, Outcome, judge};
use gyronet_host_tests::situations::receiver::{INERTIAL, Receiver, Set, Slow};
use gyronet_host_tests::situations::ride::{Ride, Travelled};
use gyronet_host_tests::situations::vehicle::{CAR, Vehicle};
use gyronet_tools::random::Random;

/// A car that nothing shakes, with a sensor without errors.
const PERFECT: Vehicle = Vehicle {
    engine: [1.0, 0.0, 0.0],
    road: [[1.0, 0.0, 0.0]; 2],
    noise: [0.0; 2],
    bias: 0.0,
    gain: 0.0,
    tilt: 0.0,
    ..CAR
};

fn ride() -> (Ride, Travelled) {
    let mut ride = Ride::default();
    ride.hold(5.0).reach(10.0, 5.0).turn(90.0, 5.0).turn(-30.0, 4.0).stop(5.0, 6.0);
    let travelled = ride.travel(&PERFECT, &mut Random::new(1, 0));
    (ride, travelled)
}

#[test]
fn the_truth_is_what_the_ride_says_and_what_a_perfect_gyro_sums_up() {
    let (ride, travelled) = ride();
    assert!((ride.end() - 30.0).abs() < 1e-9 && (travelled.seconds() - 30.0).abs() < 1e-9);
    for (time, degrees) in [(10.0, 0.0), (15.0, 90.0), (19.0, 60.0), (30.0, 60.0)] {
        assert!((travelled.heading(time).to_degrees() - degrees).abs() < 1e-6, "{time} s");
    }
    assert!((travelled.speed(12.0) - 10.0).abs() < 1e-9 && travelled.speed(29.0).abs() < 1e-9);
    // The body rolls by 3 deg in the turn, so its own z axis turns by less than 0.2 % less.
    let summed = (0..3_000).map(|step| travelled.mean(0.01 * f64::from(step), 0.01 * f64::from(step + 1))[2]);
    let summed = 0.01 * summed.sum::<f64>();
    assert!((summed / travelled.heading(30.0) - 1.0).abs() < 2e-3, "{summed}");
    // At rest gravity alone is felt; in the turn, speed times rate to the left.
    assert!((travelled.mean(1.0, 2.0)[5] - 9.80665).abs() < 1e-6);
    let left = travelled.mean(12.4, 12.6)[4];
    assert!((left - 10.0 * travelled.rate(12.5)).abs() < 0.4, "{left}");
}

/// The letters of the promises that are broken by right messages after a change.
fn broken(change: impl Fn(&mut Receiver)) -> String {
    let (_, travelled) = ride();
    let mut received = Receiver::new(INERTIAL);
    for step in 1..3_000 {
        let sampled = 0.01 * f64::from(step);
        let yaw = travelled.heading(sampled);
        received.sets.push(Set { sampled, yaw, quality: 0, faults: 0, sigma: Some(2e-4) });
        if step % 100 == 0 {
            received.slow.push(Slow {
                at: sampled,
                stands: false,
                contradicted: false,
                doubted_bias: false,
                gaps: 0,
                doubt: None,
            });
        }
    }
    change(&mut received);
    let outcome = Outcome { seconds: 30, least: 0.7, ..judge(&received, &travelled, 30.0, &EXACT) };
    outcome.broken().iter().map(|(letter, _)| letter).collect()
}

#[test]
fn each_promise_can_be_broken() {
    let shift = |received: &mut Receiver, by: f64, sigma: f64| {
        for set in received.sets.iter_mut().skip(1_500) {
            set.yaw += by;
            set.sigma = Some(sigma);
        }
    };
    let bad = |received: &mut Receiver, faults: u8| {
        for set in &mut received.sets[1_450..1_550] {
            (set.quality, set.faults) = (3, faults);
        }
    };
    assert_eq!(broken(|_| ()), "");
    assert_eq!(broken(|received| shift(received, 7e-4, 2e-4)), "");
    assert_eq!(broken(|received| shift(received, 2e-3, 2e-4)), "sy");
    assert_eq!(broken(|received| shift(received, 2e-3, 6e-4)), "", "an error that is stated");
    let hidden = |received: &mut Receiver| {
        shift(received, 0.1, 2e-4);
        bad(received, 2);
    };
    assert_eq!(broken(hidden), "y", "yaw that moves while no second is good");
    assert_eq!(
        broken(|received| {
            hidden(received);
            received.slow.iter_mut().skip(15).for_each(|slow| slow.gaps = 1);
        }),
        "",
        "a gap that is counted"
    );
    let doubted = |doubt: f64| {
        broken(|received| {
            hidden(received);
            received.slow.iter_mut().skip(15).for_each(|slow| (slow.gaps, slow.doubt) = (1, Some(doubt)));
        })
    };
    let stated = (doubted(0.03), doubted(0.02));
    assert_eq!(stated, ("".into(), "d".into()), "what may be missing is stated, or too little");
    assert_eq!(broken(|received| received.slow[10..14].iter_mut().for_each(|slow| slow.stands = true)), "t");
    let ends = |received: &mut Receiver, faults: u8| {
        received.sets[2_450..].iter_mut().for_each(|set| (set.quality, set.faults) = (1, faults));
    };
    assert_eq!(
        (broken(|received| ends(received, 0)), broken(|received| ends(received, 8))),
        ("m".into(), "".into())
    );
    assert_eq!(broken(|received| received.sets[..1_500].iter_mut().for_each(|set| set.quality = 2)), "g");
}
