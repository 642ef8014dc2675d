//! The f32 FoGNet against PyTorch: the same checkpoint, the same windows, every layer.

use gyronet::model::fognet_blob::{HIDDEN2, INPUTS};
use gyronet::model::fognet_f32::FogLayerOutputs;
use gyronet::seconds::STEPS;
use gyronet_host_tests::recordings::workspace;
use gyronet_tools::fog_checkpoint::FogCheckpoint;
use safetensors::{Dtype, SafeTensors};

const WINDOWS: usize = 8;
/// f32 sums of a few hundred products of order 1, in another order than PyTorch's.
const TOLERANCE: f32 = 1e-5;

fn tensor(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Vec<f32> {
    let view = file.tensor(name).expect(name);
    assert_eq!((view.dtype(), view.shape()), (Dtype::F32, shape), "{name}");
    view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

#[test]
fn every_layer_equals_pytorch() {
    let weights = workspace().join("tools/weights");
    let checkpoint =
        FogCheckpoint::read(&weights.join("fognet.safetensors")).expect("the committed checkpoint");
    let network = checkpoint.network();
    let bytes = std::fs::read(weights.join("fognet.golden.safetensors")).expect("the committed tensors");
    let golden = SafeTensors::deserialize(&bytes).expect("safetensors");

    let input = tensor(&golden, "input", &[WINDOWS, STEPS, INPUTS]);
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
        let theirs = tensor(&golden, name, shape);
        assert_eq!(ours.len(), theirs.len());
        let largest = |values: &[f32]| values.iter().fold(0.0f32, |max, value| max.max(value.abs()));
        let difference: Vec<f32> = ours.iter().zip(&theirs).map(|(ours, theirs)| ours - theirs).collect();
        let (difference, value) = (largest(&difference), largest(&theirs));
        println!("{name}: largest difference {difference:.2e}, largest value {value:.3}");
        assert!(difference <= TOLERANCE, "{name}");
        assert!(value > 0.0, "{name} says nothing");
    }
    // The corrections are small numbers: they must agree as parts of themselves too.
    let theirs = tensor(&golden, "correction", &[WINDOWS]);
    for (ours, theirs) in outputs.iter().zip(theirs) {
        assert!(
            (ours.correction - theirs).abs() <= 1e-3 * theirs.abs() + 1e-8,
            "{} {theirs}",
            ours.correction
        );
    }
}
