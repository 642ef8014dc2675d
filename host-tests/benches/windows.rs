//! Benchmark of one GyroNet window on the host: integer kernels and f32 reference.
//!
//! For comparison, the same network on an x86 core takes: ONNX Runtime int8 50 us, RTNeural 54 us, ONNX Runtime f32
//! 65 us, PyTorch 330 us.

use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::noise::Noise;
use std::hint::black_box;
use std::time::Instant;

/// Number of rounds, of which the median is reported, and of windows in each.
const ROUNDS: usize = 101;
const WINDOWS: u32 = 100;

/// Returns roughly a car's accelerations and rates: up to 1 m/s^2 and 0.02 rad/s on every axis.
fn window() -> [Features; WINDOW] {
    let mut noise = Noise::new(1);
    let force = i64::from(SpecificForce::PER_METRE_PER_SEC2 as i32);
    let rate = i64::from(AngularRate::PER_RAD_PER_SEC as i32) / 50;
    let mut code =
        |axis| noise.int(if axis < 3 { -force } else { -rate }, if axis < 3 { force } else { rate });
    std::array::from_fn(|_| std::array::from_fn::<i32, FEATURES, _>(|axis| code(axis) as i32))
}

/// Prints the median time of a window.
fn measure<T>(name: &str, mut run: impl FnMut() -> T) {
    let mut rounds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            (0..WINDOWS).for_each(|_| drop(black_box(run())));
            start.elapsed().as_secs_f64() * 1e6 / f64::from(WINDOWS)
        })
        .collect();
    rounds.sort_by(f64::total_cmp);
    println!("{name}: {:.1} us, fastest {:.1} us", rounds[ROUNDS / 2], rounds[0]);
}

fn main() {
    let window = window();
    let mut integer = GyroNet::new(Blob::new_checked(&weights::GYRONET.0).expect("the weights are good"));
    measure("gyronet/window", || integer.estimate(black_box(&window)));
    measure("gyronet/newest", || integer.estimate_newest(black_box(&window)));
    let checkpoint = gyronet_tools::bundled::checkpoint().expect("the checkpoint is good");
    let mut reference = checkpoint.network();
    measure("gyronet/f32", || reference.estimate(black_box(&window)));
}
