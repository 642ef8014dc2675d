//! The f32 FoGNet against PyTorch: the same checkpoint, the same windows, every layer.

use gyronet::model::fognet_blob::{HIDDEN2, INPUTS};
use gyronet::model::fognet_f32::FogLayerOutputs;
use gyronet::model::seconds::STEPS;
use gyronet_host_tests::golden::{Golden, WINDOWS};
use gyronet_host_tests::recordings::workspace;
use gyronet_tools::network::checkpoint::{Checkpoint, FogNet};

#[test]
fn every_layer_equals_pytorch() {
    let path = workspace().join("tools/weights/fognet.safetensors");
    let checkpoint = Checkpoint::<FogNet>::read(&path).expect("the committed checkpoint");
    let network = checkpoint.network();
    let golden = Golden::read("fognet");

    let input = golden.tensor("input", &[WINDOWS, STEPS, INPUTS]);
    let (windows, _) = input.as_chunks::<INPUTS>().0.as_chunks::<STEPS>();
    let outputs: Vec<_> = windows.iter().map(|window| network.layers(window)).collect();
    let flat = |layer: fn(&FogLayerOutputs) -> Vec<f32>| outputs.iter().flat_map(layer).collect::<Vec<f32>>();
    for (name, shape, ours) in [
        ("normalised", &[WINDOWS, STEPS, INPUTS][..], flat(|o| o.normalised.concat())),
        ("f1", &[WINDOWS, STEPS], flat(|o| o.f1.to_vec())),
        ("layer2_last", &[WINDOWS, 2 * HIDDEN2], flat(|o| o.layer2_last.to_vec())),
        ("f2", &[WINDOWS], flat(|o| vec![o.f2])),
        ("f3", &[WINDOWS], flat(|o| vec![o.f3])),
        ("correction", &[WINDOWS], flat(|o| vec![o.correction])),
        ("prediction", &[WINDOWS], flat(|o| vec![o.prediction])),
    ] {
        golden.compare(name, shape, &ours);
    }
    // The corrections are small numbers: they must agree as parts of themselves too.
    let theirs = golden.tensor("correction", &[WINDOWS]);
    for (ours, theirs) in outputs.iter().zip(theirs) {
        assert!((ours.correction - theirs).abs() <= 1e-3 * theirs.abs() + 1e-8, "{theirs}");
    }
}
