//! One GyroNet window on the host: integer kernels and f32 reference.
//!
//! Compare with what others need for the same network on an x86 core: ONNX Runtime int8 50 us,
//! RTNeural 54 us, ONNX Runtime f32 65 us, PyTorch 330 us.

use criterion::{Criterion, criterion_group, criterion_main};
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_tools::network::checkpoint::{self, Checkpoint};
use std::hint::black_box;
use std::path::Path;

/// A car's accelerations and rates, roughly: 1 m/s^2 and 0.02 rad/s of everything.
fn window() -> [Features; WINDOW] {
    let mut state = 1u32;
    std::array::from_fn(|_| {
        std::array::from_fn::<i32, FEATURES, _>(|k| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let uniform = f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0;
            let (size, per_unit) = if k < 3 {
                (1.0, SpecificForce::PER_METRE_PER_SEC2)
            } else {
                (0.02, AngularRate::PER_RAD_PER_SEC)
            };
            (uniform * size * f64::from(per_unit)) as i32
        })
    })
}

fn windows(criterion: &mut Criterion) {
    let window = window();
    let mut integer = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("the weights are good"));
    criterion.bench_function("gyronet/window", |bench| {
        bench.iter(|| integer.estimate(black_box(&window)));
    });
    criterion.bench_function("gyronet/newest", |bench| {
        bench.iter(|| integer.estimate_newest(black_box(&window)));
    });
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tools/weights/gyronet.safetensors");
    let checkpoint = Checkpoint::<checkpoint::GyroNet>::read(&path).expect("the checkpoint is good");
    let mut reference = checkpoint.network();
    criterion.bench_function("gyronet/f32", |bench| {
        bench.iter(|| reference.estimate(black_box(&window)));
    });
}

criterion_group!(benches, windows);
criterion_main!(benches);
