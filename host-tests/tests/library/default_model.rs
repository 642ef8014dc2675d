//! The default model that comes with the library is linear, and answers nothing that is constant.

use gyronet::model::weights::DEFAULT;
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, GyroNet, WindowNetwork};
use gyronet::units::AngularRate;
use gyronet_host_tests::noise::Noise;

/// Every row's weights of an input add up to zero, and roll and pitch rate have none: bias, gain and mounting belong to the
/// unit, which the board and `gyronet calibrate` find.
#[test]
fn nothing_constant_is_corrected() {
    let blob = Blob::new_checked(&DEFAULT.0).expect("they come with the library");
    let linear = blob.linear.expect("it is one");
    assert_eq!((blob.shape.units, linear.rows().count()), (0, WINDOW));
    for row in linear.rows() {
        for feature in 0..FEATURES {
            let weights = row.iter().skip(feature).step_by(FEATURES);
            let is_used = weights.clone().any(|weight| *weight != 0);
            assert_eq!(is_used, ![3, 4].contains(&feature), "feature {feature}");
            assert_eq!(weights.map(|weight| i64::from(*weight)).sum::<i64>(), 0, "feature {feature}");
        }
    }
    let (mut network, mut noise) = (GyroNet::new(blob), Noise::new(11));
    for _ in 0..200 {
        let constant: [i32; FEATURES] =
            std::array::from_fn(|_| noise.int(i32::MIN.into(), i32::MAX.into()) as i32);
        let estimate = network.estimate(&[constant; WINDOW]);
        assert_eq!(estimate.corrections, [AngularRate::ZERO; WINDOW], "{constant:?}");
    }
}
