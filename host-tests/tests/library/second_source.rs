//! Sources of the yaw rate that contradict each other: the one that is alone is doubted, and no other.

use gyronet::bias::Latitude;
use gyronet::coprocessor::Contradiction;
use gyronet::estimate::YawEstimate;
use gyronet::fog::FogConfig;
use gyronet::health::{Faults, Quality};
use gyronet::sample::{FogSample, PERIOD_US};
use gyronet::units::{Angle, Micros};
use gyronet::{Config, Coprocessor};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::synthetic::{force, noisy, rate, turning};
use gyronet_tools::drive::wheel_frames::{frame, receiver};

/// Factors on what each source reads of a turn of 5 deg/s at 15 m/s: inertial gyro, fibre-optic gyro (0: none), and
/// left and right wheel.
struct Read {
    inertial: f64,
    fog: f64,
    wheels: [f64; 2],
}

/// The Earth's rate at 48 deg north, rad/s.
const EARTH: f64 = 5.419e-5;

const TRUE: Read = Read { inertial: 1.0, fog: 1.0, wheels: [1.0; 2] };

/// The last rates of both gyros after 8 s of turn.
fn turned(read: &Read) -> (YawEstimate, Option<YawEstimate>) {
    shown(read).0
}

/// Also what the sources showed when they last contradicted each other.
fn shown(read: &Read) -> ((YawEstimate, Option<YawEstimate>), Contradiction) {
    let fog = FogConfig { latitude: Latitude::from_degrees(48.0), ..FogConfig::DEFAULT };
    let config = Config { wheels: Some(receiver()), fog, fog_expected: read.fog != 0.0, ..Config::DEFAULT };
    let (mut coprocessor, mut noise, mut sent) = (Coprocessor::new(config), Noise::new(3), Sent::default());
    for tick in 1..=1_300 {
        let now = Micros(tick * PERIOD_US);
        let (speed, yaw) = if tick > 500 { (15.0, 5_f64.to_radians()) } else { (0.0, 0.0) };
        let axle = [-0.75, 0.75].map(|side| speed + side * yaw);
        let [left, right] = [0, 1].map(|wheel| axle[wheel] * read.wheels[wheel]);
        let wheels = frame([left, right, left, right].map(|speed| Some(3.6 * speed))).expect("all are known");
        coprocessor.can(&wheels, now).expect("a good frame");
        let mut sample = turning(tick, rate(0.001 + yaw * read.inertial));
        sample.specific_force[1] = force(speed * yaw);
        coprocessor.imu(noisy(sample, [2e-4, 2e-3], &mut noise), now, &mut sent).expect("in time");
        if read.fog != 0.0 {
            let angle = Angle::from_rad(((yaw + EARTH) * read.fog * 0.01 + 1e-7 * noise.normal()) as f32)
                .expect("in range");
            let increment = [None, None, Some(angle)];
            let sample = FogSample { time: now, span: 10_000, lost: 0, increment, temperature: None };
            coprocessor.fog(sample, now, &mut sent).expect("in order");
        }
    }
    let rates = (sent.seen.last().expect("a step").vehicle.live, sent.fog.last().copied());
    (rates, *coprocessor.contradiction())
}

const DOUBTED: (bool, bool) = (true, true);
const GOOD: (bool, bool) = (false, false);

/// Implausible, and not good, by any fault but the late window of a board without a network.
fn doubted(estimate: &YawEstimate) -> (bool, bool) {
    (estimate.faults.contains(Faults::IMPLAUSIBLE), estimate.quality != Quality::Good)
}

#[test]
fn sources_that_agree_are_not_doubted() {
    for wheels in [[1.0; 2], [1.01, 0.99]] {
        let (inertial, fog) = turned(&Read { wheels, ..TRUE });
        assert!(!inertial.faults.contains(Faults::IMPLAUSIBLE), "{inertial:?}");
        assert!(!inertial.faults.contains(Faults::WHEELS), "{inertial:?}");
        assert_eq!(doubted(&fog.expect("a rate")), GOOD);
    }
}

/// The gyro is set to degrees, to the other direction, or has lost its scale.
#[test]
fn a_fibre_optic_gyro_that_is_alone_is_doubted() {
    for factor in [57.295_78, -1.0, 0.5, 1.5] {
        let (inertial, fog) = turned(&Read { fog: factor, ..TRUE });
        assert_eq!(doubted(&fog.expect("a rate")), DOUBTED, "{factor}");
        assert_eq!(
            inertial.faults.contains(Faults::IMPLAUSIBLE),
            factor.abs() < 2.0 && factor > 0.0,
            "{factor}"
        );
    }
}

/// In a turn of 5 deg/s at 15 m/s the gyro shows half; the wheels are 1.5 m apart, the lateral force is 1.31 m/s^2.
#[test]
fn a_contradiction_leaves_its_numbers() {
    let (_, Contradiction { seconds, gyros, lateral, wheels }) = shown(&Read { fog: 0.5, ..TRUE });
    let near = |code: Option<i16>, shown: f64, within: f64| {
        let code = f64::from(code.expect("it was shown")) / 100.0;
        assert!((code - shown).abs() <= within, "{code}, {shown} was shown");
    };
    assert!((6..=8).contains(&seconds), "{seconds}");
    near(gyros[0], 5.0, 0.06);
    near(gyros[1], 2.5, 0.06);
    near(lateral, 1.31, 0.02);
    near(wheels.map(|[speed, _]| speed), 15.0, 0.02);
    near(wheels.map(|[_, difference]| difference), 0.13, 0.02);
    assert_eq!(shown(&TRUE).1, Contradiction::default());
}

#[test]
fn an_inertial_gyro_that_is_alone_is_doubted() {
    for factor in [-1.0, 20.0] {
        let (inertial, fog) = turned(&Read { inertial: factor, ..TRUE });
        assert!(inertial.faults.contains(Faults::IMPLAUSIBLE), "{factor}");
        assert_eq!(doubted(&fog.expect("a rate")), GOOD, "{factor}");
    }
    // Without a fibre-optic gyro wheels and accelerometer contradict it.
    let (inertial, _) = turned(&Read { inertial: 20.0, fog: 0.0, ..TRUE });
    assert!(inertial.faults.contains(Faults::IMPLAUSIBLE));
}

#[test]
fn wheels_that_are_alone_are_doubted() {
    for wheels in [[1.0, 0.0], [1.0, 1.3], [1.3, 1.0]] {
        for fog in [0.0, 1.0] {
            let (inertial, fog) = turned(&Read { wheels, fog, ..TRUE });
            assert!(inertial.faults.contains(Faults::WHEELS), "{wheels:?}");
            assert!(!inertial.faults.contains(Faults::IMPLAUSIBLE), "{wheels:?}");
            assert!(fog.is_none_or(|fog| !fog.faults.contains(Faults::IMPLAUSIBLE)), "{wheels:?}");
        }
    }
}
