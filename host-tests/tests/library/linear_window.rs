//! The linear window that comes with the library: it has no constant of its own, and it is as good as the README of the
//! training says.

use gyronet::model::weights::LINEAR_WINDOW;
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::model::{Blob, GyroNet, WindowNetwork};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::noise::Noise;

fn network() -> GyroNet<'static> {
    GyroNet::new(Blob::new_checked(&LINEAR_WINDOW.0).expect("they come with the library"))
}

/// An acceleration that does not change adds nothing, exactly: every row's weights of each axis add up to zero.
#[test]
fn a_level_of_the_accelerometer_corrects_nothing() {
    let blob = Blob::new_checked(&LINEAR_WINDOW.0).expect("they come with the library");
    let linear = blob.linear.expect("it is one");
    assert_eq!((blob.shape.units, linear.rows().count()), (0, WINDOW));
    for row in linear.rows() {
        for axis in 0..3 {
            let weights = row.iter().skip(axis).step_by(FEATURES);
            assert!(weights.clone().any(|weight| *weight != 0), "axis {axis} has a part");
            assert_eq!(weights.map(|weight| i64::from(*weight)).sum::<i64>(), 0, "axis {axis}");
        }
    }
    let mut noise = Noise::new(11);
    for _ in 0..200 {
        let force = i64::from(i32::MAX);
        let level: [i32; 3] = std::array::from_fn(|_| noise.int(-force, force) as i32);
        let [x, y, z] = level;
        let estimate = network().estimate(&[[x, y, z, 0, 0, 0]; WINDOW]);
        assert_eq!(estimate.corrections, [AngularRate::ZERO; WINDOW], "{level:?}");
    }
}

/// A constant turn is corrected by the unit's gain alone, in every sample alike.
#[test]
fn a_constant_turn_is_corrected_by_the_gain() {
    let one = AngularRate::PER_RAD_PER_SEC as i32;
    let gravity = (9.81 * SpecificForce::PER_METRE_PER_SEC2) as i32;
    let turning: [Features; WINDOW] = [[0, 0, gravity, 0, 0, one]; WINDOW];
    let corrections = network().estimate(&turning).corrections;
    let gain = corrections[0].rad_per_sec();
    assert!((0.0005..0.002).contains(&gain), "a gain of 0.1 %: {gain}");
    for correction in corrections {
        assert!((correction.rad_per_sec() - gain).abs() < 1e-6, "{corrections:?}");
    }
}
