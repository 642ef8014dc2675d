//! The image in QEMU for a long time; `-icount` keeps its clock in step with its instructions. Every
//! frame equals the host's, across the wrap of the part's ticks, and nothing is counted that
//! should not be.

use gyronet::sample::RATE_HZ;
use gyronet::sensor::xsens::MtData2;
use gyronet::service::message::AllCounters;
use gyronet_host_tests::{connected, image, qemu, replay};
use gyronet_tools::simulate::{Config, Simulation};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(90 * 60);
/// A simulated drive as an MTi would send it, its ticks and packet counter wrapping in the middle.
fn bytes(samples: u32) -> Vec<u8> {
    let drive = (0..samples).zip(Simulation::new(&Config::DEFAULT));
    drive.flat_map(|(k, sample)| message(samples, k, &sample).emit()).collect()
}

fn message(samples: u32, k: u32, sample: &gyronet_tools::simulate::Sample) -> MtData2 {
    MtData2 {
        packet_counter: Some((k as u16).wrapping_sub((samples / 2) as u16)),
        sample_time_fine: Some(k.wrapping_sub(samples / 2).wrapping_mul(100)),
        acceleration: Some(sample.specific_force.map(|force| force as f32)),
        rate_of_turn: Some(sample.angular_rate.map(|rate| rate as f32)),
        temperature: None,
        status: Some(3),
    }
}

fn soak(test: &str, minutes: u32) {
    let Some(elf) = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR")) else { return };
    let samples = 60 * minutes * RATE_HZ;
    let bytes = bytes(samples);
    let expected = replay::lines(&bytes);
    let start = Instant::now();
    let mut board = qemu::Board::boot(&elf, qemu::SERVICE, &[]);
    board.send(1, &bytes, LIMIT);
    let lines = board.lines(2, b'\r', expected.len(), LIMIT);
    println!(
        "{test}: {minutes} min of samples, {} frames in {:.0?} of wall time",
        expected.len(),
        start.elapsed()
    );
    replay::assert_same(&lines, &expected);
    let AllCounters { pipeline, lines, .. } = connected::counters(&mut board.device(LIMIT));
    println!("{test}: {pipeline:?} {lines:?}");
    assert_eq!(pipeline.samples, samples);
    let windows = (samples - 300) / 5;
    assert!((windows - 10..=windows).contains(&pipeline.windows), "{} windows", pipeline.windows);
    assert_eq!([pipeline.missing, pipeline.misplaced, pipeline.clock_jumps, pipeline.late], [0; 4]);
    assert_eq!([lines.unsent, lines.service_errors], [0; 2]);
}

#[test]
fn a_minute_equals_the_host() {
    soak("a_minute_equals_the_host", 1);
}

/// `cargo test -p gyronet-host-tests --test image firmware_soak -- --ignored --nocapture`
#[test]
#[ignore = "takes about as long as it says"]
fn half_an_hour_equals_the_host() {
    soak("half_an_hour_equals_the_host", 30);
}
