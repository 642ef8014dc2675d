//! Both networks on windows whose outputs PyTorch has computed: the f32 references layer by layer, and the integer
//! GyroNet of the built-in weight file in its output.

use gyronet::model::WindowNetwork;
use gyronet::model::blob::HIDDEN;
use gyronet::model::fognet_blob::{HIDDEN2, INPUTS};
use gyronet::model::seconds::STEPS;
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::golden::{Golden, WINDOWS};
use gyronet_host_tests::models;
use gyronet_host_tests::recordings::workspace;
use gyronet_tools::bundled;
use gyronet_tools::network::checkpoint::{Checkpoint, FogNet};
use gyronet_tools::network::reference::fognet::FogLayerOutputs;
use gyronet_tools::network::reference::gyronet::LayerOutputs;

#[test]
fn every_layer_of_gyronet_equals_pytorch() {
    let checkpoint = bundled::checkpoint().expect("the committed checkpoint");
    let network = checkpoint.network();
    let golden = Golden::read("gyronet");

    let input = golden.tensor("input", &[WINDOWS, WINDOW, FEATURES]);
    let (windows, _) = input.as_chunks::<FEATURES>().0.as_chunks::<WINDOW>();
    let outputs: Vec<_> = windows.iter().map(|window| network.layers(window)).collect();
    let layer = |name, shape: &[usize], layer: fn(&LayerOutputs) -> Vec<f32>| {
        golden.compare(name, shape, &outputs.iter().flat_map(layer).collect::<Vec<f32>>());
    };
    layer("normalised", &[WINDOWS, WINDOW, FEATURES], |o| o.normalised.concat());
    layer("layer1", &[WINDOWS, WINDOW, 2 * HIDDEN], |o| o.layer1.concat());
    layer("layer2", &[WINDOWS, WINDOW, 2 * HIDDEN], |o| o.layer2.concat());
    layer("gyro_error", &[WINDOWS, WINDOW], |o| o.gyro_error.to_vec());
}

#[test]
fn every_layer_of_fognet_equals_pytorch() {
    let path = workspace().join("tools/weights/fognet.safetensors");
    let checkpoint = Checkpoint::<FogNet>::read(&path).expect("the committed checkpoint");
    let network = checkpoint.network();
    let golden = Golden::read("fognet");

    let input = golden.tensor("input", &[WINDOWS, STEPS, INPUTS]);
    let (windows, _) = input.as_chunks::<INPUTS>().0.as_chunks::<STEPS>();
    let outputs: Vec<_> = windows.iter().map(|window| network.layers(window)).collect();
    let layer = |name, shape: &[usize], layer: fn(&FogLayerOutputs) -> Vec<f32>| {
        golden.compare(name, shape, &outputs.iter().flat_map(layer).collect::<Vec<f32>>());
    };
    layer("normalised", &[WINDOWS, STEPS, INPUTS], |o| o.normalised.concat());
    layer("f1", &[WINDOWS, STEPS], |o| o.f1.to_vec());
    layer("layer2_last", &[WINDOWS, 2 * HIDDEN2], |o| o.layer2_last.to_vec());
    layer("f2", &[WINDOWS], |o| vec![o.f2]);
    layer("f3", &[WINDOWS], |o| vec![o.f3]);
    layer("correction", &[WINDOWS], |o| vec![o.correction]);
    layer("prediction", &[WINDOWS], |o| vec![o.prediction]);
    // The corrections are small numbers: they must agree as parts of themselves too.
    let theirs = golden.tensor("correction", &[WINDOWS]);
    for (ours, theirs) in outputs.iter().zip(theirs) {
        assert!((ours.correction - theirs).abs() <= 1e-3 * theirs.abs() + 1e-8, "{theirs}");
    }
}

/// Largest RMS of the difference of outputs, over the golden outputs' own RMS; 0.25 % is printed below.
const OUTPUT: f64 = 0.01;

/// A sample's features in codes. The order is that of the training: specific force x, y, z, angular rate x, y, z.
fn codes(sample: &[f32; FEATURES]) -> Features {
    let [fx, fy, fz, wx, wy, wz] = *sample;
    let force = |value: f32| (value * SpecificForce::PER_METRE_PER_SEC2).round() as i32;
    let rate = |value: f32| (value * AngularRate::PER_RAD_PER_SEC).round() as i32;
    [force(fx), force(fy), force(fz), rate(wx), rate(wy), rate(wz)]
}

#[test]
fn the_integer_network_equals_pytorch() {
    let golden = Golden::read("gyronet");
    let input = golden.tensor("input", &[WINDOWS, WINDOW, FEATURES]);
    let error = golden.tensor("gyro_error", &[WINDOWS, WINDOW]);
    let (windows, _) = input.as_chunks::<FEATURES>().0.as_chunks::<WINDOW>();
    let mut network = models::gyronet();
    let (mut difference, mut size, mut compared) = (0.0, 0.0, 0);
    for (window, due) in windows.iter().zip(error.as_chunks::<WINDOW>().0) {
        let estimate = network.estimate(&window.each_ref().map(codes));
        if estimate.clamped_inputs > 0 {
            // Inputs beyond the integer network's range are clamped, which PyTorch does not do.
            continue;
        }
        compared += 1;
        for (ours, due) in estimate.corrections.iter().zip(due) {
            let ours = f64::from(ours.0) / f64::from(AngularRate::PER_RAD_PER_SEC);
            difference += (ours - f64::from(*due)).powi(2);
            size += f64::from(*due).powi(2);
        }
    }
    let relative = (difference / size).sqrt();
    println!("integer network: {:.2} % RMS from PyTorch's outputs in {compared} windows", 100.0 * relative);
    assert!(compared >= WINDOWS / 2, "{compared} windows are inside the input's range");
    assert!(relative < OUTPUT, "{relative}");
}
