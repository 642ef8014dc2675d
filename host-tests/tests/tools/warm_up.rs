//! The heading of half an hour without a stop while the sensor warms up, simulated.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet_tools::warm_up;

/// Devices of these seeds had no part in the choice of any number.
const SEED: u64 = 901;

#[test]
fn the_bias_curve_leaves_a_fifth_of_the_drift_at_most_and_rear_wheels_alone_more() {
    let mut network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("the built-in weights"));
    let outcome = warm_up::run(2, SEED, &mut network, || {}).expect("drives that begin at rest");
    let ratio = |name: &str| outcome.rows.iter().find(|row| row.name == name).expect("a row").ratio;
    let (curve, wheels) = (ratio("default"), ratio("rear_wheels"));
    println!("over static initialisation and zero-rate updates: curve {curve:.3}, rear wheels {wheels:.3}");
    assert!(curve <= 0.2, "{curve}");
    assert!(wheels > 2.0 * curve, "{wheels}");
    let [with, _] = outcome.inside_one_sigma;
    assert!(with > 0.6, "{with}");
}
