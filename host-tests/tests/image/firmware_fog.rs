//! The image with everything connected, in QEMU: 30 s of a real drive from an MTi, a fibre-optic
//! gyro that is simulated from the reference, wheel frames over SLCAN. GyroNet and FoGNet both
//! run, and every frame equals the host's.

use gyronet::can::yaw::{FOG_IDS, Quality, RateMessage, Source};
use gyronet::health::InputCounters;
use gyronet::store::Configuration;
use gyronet_host_tests::connected::{self, Step};
use gyronet_host_tests::{image, qemu, recordings};
use std::time::Instant;

/// 30 s.
const SAMPLES: usize = 3_000;

#[test]
fn both_networks_run_with_everything_connected() {
    const NAME: &str = "both_networks_run_with_everything_connected";
    let Some(path) = recordings::trial(NAME, 11) else { return };
    let Some(elf) = image::coprocessor(NAME, env!("CARGO_TARGET_TMPDIR")) else { return };
    let rows = recordings::rows(&path);
    let mut board = qemu::Board::boot(&elf, connected::USARTS, &[]);
    let start = Instant::now();
    let steps: Vec<Step> =
        rows.iter().take(SAMPLES).enumerate().map(|(number, row)| Step::of(number, row)).collect();
    let outcome = connected::run(&mut board, &Configuration::DEFAULT, &steps);
    let lines = &outcome.followed.lines;
    println!("{NAME}: {} frames in {:.1?}", outcome.sent, start.elapsed());
    println!("{NAME}: {} sets because the host was busy", outcome.followed.followed);
    // Both networks have run.
    let count = |id, source| {
        let good = |rate: &RateMessage| rate.source == source && rate.quality == Quality::Good;
        let rates: Vec<_> = connected::rates(lines, id).map(|(_, rate)| rate).collect();
        (rates.len(), rates.iter().filter(|rate| good(rate)).count())
    };
    let (own, gyronet) = count(0x1A0, Source::GyroNet);
    let (fog, fognet) = count(FOG_IDS[0], Source::FogNet);
    println!("{NAME}: {own} sets, {gyronet} by GyroNet; {fog} of the gyro, {fognet} by FoGNet");
    assert!(gyronet >= SAMPLES - 330 && fognet >= SAMPLES - 600, "{gyronet} {fognet}");
    // And nobody was late, nothing was dropped. (The 10 ms of the gyro come at once, not at 921600
    // bit/s: that its line is held meanwhile says nothing.)
    let counters = outcome.counters;
    println!("{NAME}: {counters:?}");
    assert_eq!(counters.fog, *outcome.host.fog());
    assert_eq!((counters.pipeline.late, counters.fog.late, counters.lines.overruns), (0, 0, 0));
    assert_eq!(counters.inputs, InputCounters::default());
    assert_eq!((counters.lines.unsent, counters.lines.line_errors), (0, 0));
}
