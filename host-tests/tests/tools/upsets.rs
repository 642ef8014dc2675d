//! Bits that flip in the weights: a small part of `gyronet campaign --upsets`.

use gyronet::compensate::CompensateConfig;
use gyronet::model::{Blob, weights};
use gyronet_tools::bundled;
use gyronet_tools::campaign::drive::Drive;
use gyronet_tools::campaign::networks::Integer;
use gyronet_tools::campaign::scene::Scene;
use gyronet_tools::campaign::weight_upsets::WeightUpsets;
use gyronet_tools::parts::Part;

const BITS: usize = 1_000;
const SEED: u64 = 1;

#[test]
fn a_flipped_bit_is_refused_or_bounded() {
    let file = &weights::GYRONET.0;
    let blob = Blob::new_checked(file).expect("they come with the library");
    let drive = Drive::new(&bundled::simulated_drive().expect("it comes with the tools"));
    let scene = Scene::new(&drive, Part::Xsens, &mut Integer::new(blob));
    let window = *scene.known.windows.keys().min().expect("a window");

    let upsets = WeightUpsets::new(file, &blob, &[window], (BITS, SEED), || {});
    print!("{upsets}");
    assert!(upsets.header_bits > 8 * 76 && upsets.header_refused == upsets.header_bits);
    assert_eq!((upsets.weight_bits, upsets.weight_refused, upsets.not_found), (BITS, BITS, 0));
    // Two passes of the background check, at 13 bytes a millisecond.
    let pass = file.len() as f64 / 13.0 * 1e-3;
    assert!(upsets.found_after[0] > 0.0 && upsets.found_after[1] <= 2.0 * pass + 0.002, "{upsets}");
    let limits = CompensateConfig::DEFAULT;
    // A believed mean and the undamaged one are both within the limit.
    let bound = 2.0 * limits.max_mean.rad_per_sec();
    assert!(upsets.effects.most <= bound && upsets.effects.panics == 0, "{upsets}");
    assert!(upsets.effects.within > BITS / 2, "most weights matter little: {upsets}");
}
