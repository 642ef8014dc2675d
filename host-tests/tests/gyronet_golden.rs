//! The f32 reference against PyTorch: the same checkpoint, the same windows, every layer.

use gyronet::model::blob::HIDDEN;
use gyronet::window::{FEATURES, WINDOW};
use gyronet_host_tests::recordings::workspace;
use gyronet_tools::checkpoint::Checkpoint;
use safetensors::{Dtype, SafeTensors};

const WINDOWS: usize = 8;
/// f32 sums of a few hundred products of order 1, twice over, in another order than PyTorch's.
const TOLERANCE: f32 = 1e-5;

/// The values of a golden tensor.
fn tensor(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Vec<f32> {
    let view = file.tensor(name).expect(name);
    assert_eq!((view.dtype(), view.shape()), (Dtype::F32, shape), "{name}");
    view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

#[test]
fn every_layer_equals_pytorch() {
    let weights = workspace().join("tools/weights");
    let checkpoint =
        Checkpoint::read(&weights.join("gyronet.safetensors")).expect("the committed checkpoint");
    let network = checkpoint.network();
    let bytes = std::fs::read(weights.join("gyronet.golden.safetensors")).expect("the committed tensors");
    let golden = SafeTensors::deserialize(&bytes).expect("safetensors");

    let input = tensor(&golden, "input", &[WINDOWS, WINDOW, FEATURES]);
    let (windows, _) = input.as_chunks::<FEATURES>().0.as_chunks::<WINDOW>();
    let outputs: Vec<_> = windows.iter().map(|window| network.layers(window)).collect();
    let flat = |layer: fn(&gyronet::model::gyronet_f32::LayerOutputs) -> Vec<f32>| {
        outputs.iter().flat_map(layer).collect::<Vec<f32>>()
    };
    for (name, shape, ours) in [
        ("normalised", &[WINDOWS, WINDOW, FEATURES][..], flat(|o| o.normalised.concat())),
        ("layer1", &[WINDOWS, WINDOW, 2 * HIDDEN], flat(|o| o.layer1.concat())),
        ("layer2", &[WINDOWS, WINDOW, 2 * HIDDEN], flat(|o| o.layer2.concat())),
        ("gyro_error", &[WINDOWS, WINDOW], flat(|o| o.gyro_error.to_vec())),
        ("log_scale", &[WINDOWS], flat(|o| vec![o.log_scale])),
    ] {
        let theirs = tensor(&golden, name, shape);
        assert_eq!(ours.len(), theirs.len());
        let largest = |values: &[f32]| values.iter().fold(0.0f32, |max, value| max.max(value.abs()));
        let difference: Vec<f32> = ours.iter().zip(&theirs).map(|(ours, theirs)| ours - theirs).collect();
        println!(
            "{name}: largest difference {:.2e}, largest value {:.3}",
            largest(&difference),
            largest(&theirs)
        );
        // A normalised input of 20 has an LSB of 2e-6; the others stay within 1.
        assert!(largest(&difference) <= TOLERANCE, "{name}");
        assert!(largest(&theirs) > 0.0, "{name} says nothing");
    }
}
