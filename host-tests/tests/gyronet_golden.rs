//! The f32 reference against PyTorch: the same checkpoint, the same windows, every layer.

use gyronet::model::blob::HIDDEN;
use gyronet::window::{FEATURES, WINDOW};
use gyronet_host_tests::golden::{Golden, WINDOWS};
use gyronet_host_tests::recordings::workspace;
use gyronet_tools::checkpoint::Checkpoint;

#[test]
fn every_layer_equals_pytorch() {
    let path = workspace().join("tools/weights/gyronet.safetensors");
    let checkpoint = Checkpoint::read(&path).expect("the committed checkpoint");
    let network = checkpoint.network();
    let golden = Golden::read("gyronet");

    let input = golden.tensor("input", &[WINDOWS, WINDOW, FEATURES]);
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
        golden.compare(name, shape, &ours);
    }
}
