//! FoGNet on five minutes of a simulated sequence that training has not seen: its corrections must be worth something
//! on the road. The figures of whole sequences are a report: `cargo gyronet tables`.

use gyronet::fog::FogConfig;
use gyronet::model::fognet::FogNetState;
use gyronet::model::{FogBlob, FogNet, weights};
use gyronet_host_tests::dead_reckoning::error;
use gyronet_tools::paper::fog_replay;
use gyronet_tools::paper::sequence::Sequence;
use gyronet_tools::simulate::layout::{self, Layout, Set, Spec};
use std::path::Path;

const SECONDS: u32 = 5 * 60;
/// Largest error of the path with FoGNet over that with the gyro alone.
const RATIO: f64 = 0.6;

fn simulated() -> Sequence {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fognet_simulated");
    let spec = Set::Test.specs(Layout::Kaist).swap_remove(0);
    layout::write(&Spec { seconds: SECONDS, ..spec }, &folder, || {}).expect("there is room");
    Sequence::read(&folder, |_| {}).expect("it has just been written")
}

#[test]
fn fognet_brings_dead_reckoning_nearer_to_the_true_path() {
    let sequence = simulated();
    let mut state = FogNetState::ZERO;
    let mut network = FogNet::new(FogBlob::new_checked(&weights::FOGNET.0).expect("checked"), &mut state);
    let drive = fog_replay::run(&sequence, &mut network, FogConfig::DEFAULT, || {});
    assert!((u64::from(SECONDS) - 5..=u64::from(SECONDS)).contains(&drive.windows), "{}", drive.windows);
    assert_eq!([drive.implausible, drive.broken, drive.clamped_inputs], [0; 3]);
    let alone = error(&sequence, sequence.steps.iter().map(|step| step.fog));
    let corrected = error(&sequence, drive.turns.iter().copied());
    println!("error of the path: {alone:.2} m with the gyro alone, {corrected:.2} m with FoGNet");
    assert!(corrected <= RATIO * alone, "{corrected:.2} of {alone:.2} m");
}
