//! Four minutes of a drive in which every clock and counter wraps; `cargo gyronet soak`
//! runs 24 hours. It measures the memory of its process, so it has one of its own.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::sample::RATE_HZ;
use gyronet_tools::campaign::soak;

#[test]
fn nothing_drifts_across_any_wrap() {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("the weights of the library");
    let soak = soak::run(4 * 60 * RATE_HZ, &mut GyroNet::new(blob), || {});
    println!("{soak}");
    assert_eq!(soak.faults(), [""; 0]);
    assert_eq!(soak.wraps, [1, 1, 1]);
    // A counter that goes round is seen only if something is there to be counted.
    assert!(soak.statuses[2] > 20_000 && soak.turns > 1.0);
}
