//! The default model that comes with the library: its linear part has no constant and no gain of its own, and its Bi-LSTM
//! states the expected error alone.

use gyronet::model::weights::DEFAULT;
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, GyroNet, WindowNetwork};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::noise::Noise;

fn network() -> GyroNet<'static> {
    GyroNet::new(Blob::new_checked(&DEFAULT.0).expect("they come with the library"))
}

/// An acceleration that does not change adds nothing, exactly: every row's weights of each axis add up to zero.
#[test]
fn a_level_of_the_accelerometer_corrects_nothing() {
    let blob = Blob::new_checked(&DEFAULT.0).expect("they come with the library");
    let linear = blob.linear.expect("it is one");
    assert_eq!((blob.shape.units, linear.rows().count()), (4, WINDOW));
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

/// A constant turn corrects nothing either: gain is the unit's, which `gyronet calibrate` finds. What is left is the
/// mounting, in every sample alike.
#[test]
fn a_constant_rate_is_corrected_by_the_mounting_alone() {
    let one = AngularRate::PER_RAD_PER_SEC as i32;
    let gravity = (9.81 * SpecificForce::PER_METRE_PER_SEC2) as i32;
    let corrections = |rates: [i32; 3]| {
        let [roll, pitch, yaw] = rates;
        network().estimate(&[[0, 0, gravity, roll, pitch, yaw]; WINDOW]).corrections
    };
    assert_eq!(corrections([0, 0, one]), [AngularRate::ZERO; WINDOW]);
    for (axis, largest) in [([one / 10, 0, 0], 0.002), ([0, one / 10, 0], 0.004)] {
        let corrections = corrections(axis).map(|correction| correction.rad_per_sec());
        assert!((0.0001..largest).contains(&corrections[0].abs()), "{axis:?}: {corrections:?}");
        assert!(corrections.iter().all(|c| (c - corrections[0]).abs() < 1e-6), "{axis:?}: {corrections:?}");
    }
}
