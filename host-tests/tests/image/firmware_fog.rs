//! The image with everything connected, in QEMU: a drive from an MTi, a fibre-optic gyro that is simulated from the
//! reference, wheel frames over SLCAN. Every frame equals the host's.

use embedded_can::Frame;
use gyronet::can::yaw::{DetailMessage, FOG_IDS, Quality, RateMessage, SIGMA_UNKNOWN, Source};
use gyronet::fog::FogNetUse;
use gyronet::health::InputCounters;
use gyronet::model::weights;
use gyronet::store::{Configuration, FogLane};
use gyronet_host_tests::connected::{self, Step};
use gyronet_host_tests::image;
use gyronet_host_tests::recordings::{self, workspace};
use gyronet_host_tests::stored::Stored;
use std::time::Instant;

/// 30 s.
const SAMPLES: usize = 3_000;

#[test]
fn both_networks_run_with_everything_connected() {
    const NAME: &str = "both_networks_run_with_everything_connected";
    let scratch = env!("CARGO_TARGET_TMPDIR");
    let Some(path) = recordings::trial(NAME, 11) else { return };
    let Some(elf) = image::coprocessor(NAME, scratch) else { return };
    let fog_lane = FogLane { fognet: FogNetUse::Simulated, ..FogLane::default() };
    let configuration =
        Configuration { fog_lane, latitude_deg: Some(36.37), fog_serial: 1, ..Configuration::DEFAULT };
    let rows = recordings::rows(&path);
    let stored = Stored::default().record(&configuration).fognet(&weights::FOGNET.0);
    let mut board = stored.boot(&elf, connected::USARTS, scratch, NAME);
    let start = Instant::now();
    let steps: Vec<Step> =
        rows.iter().take(SAMPLES).enumerate().map(|(number, row)| Step::from_row(number, row)).collect();
    let outcome = connected::run(&mut board, &configuration, &steps);
    let lines = &outcome.followed.lines;
    println!("{NAME}: {} frames in {:.1?}", outcome.sent, start.elapsed());
    println!("{NAME}: {} sets because the host was busy", outcome.followed.followed);
    // Both networks have run; weights that were trained on simulated drives are never good.
    let count = |id, source, quality| {
        let by = |rate: &RateMessage| rate.source == source && rate.quality == quality;
        let rates: Vec<_> = connected::rates(lines, id).map(|(_, rate)| rate).collect();
        (rates.len(), rates.iter().filter(|rate| by(rate)).count())
    };
    let (own, gyronet) = count(0x1A0, Source::GyroNet, Quality::Good);
    let (fog, fognet) = count(FOG_IDS[0], Source::FogNet, Quality::Degraded);
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

/// FoGNet's weights for another gyro do not run: the rate is that of the default lane, and says that something stored is
/// not used.
#[test]
fn weights_for_another_gyro_do_not_run() {
    const NAME: &str = "weights_for_another_gyro_do_not_run";
    let scratch = env!("CARGO_TARGET_TMPDIR");
    let Some(elf) = image::coprocessor(NAME, scratch) else { return };
    let rows = recordings::rows(&workspace().join("tools/data/simulated_drive.csv"));
    let steps: Vec<Step> =
        rows.iter().take(40).enumerate().map(|(number, row)| Step::from_row(number, row)).collect();
    let fog_lane = FogLane { fognet: FogNetUse::Simulated, ..FogLane::default() };
    let configuration =
        Configuration { fog_lane, latitude_deg: Some(36.37), fog_serial: 2, ..Configuration::DEFAULT };
    let stored = Stored::default().record(&configuration).fognet(&weights::FOGNET.0);
    let mut board = stored.boot(&elf, connected::USARTS, scratch, NAME);
    let outcome = connected::run(&mut board, &configuration, &steps);
    let rates: Vec<RateMessage> =
        connected::rates(&outcome.followed.lines, FOG_IDS[0]).map(|(_, rate)| rate).skip(10).collect();
    assert!(!rates.is_empty());
    assert!(rates.iter().all(|rate| (rate.source, rate.quality) == (Source::EarthRate, Quality::Degraded)));
}

/// The Earth's rate that is configured comes off at the image's output, to the last bit as on the host, and every rate
/// has an expected error.
#[test]
fn the_earth_comes_off_at_four_latitudes() {
    const NAME: &str = "the_earth_comes_off_at_four_latitudes";
    /// Samples with rates of the vehicle at rest, before the wheels are known to stand.
    const AT_REST: usize = 40;
    let scratch = env!("CARGO_TARGET_TMPDIR");
    let Some(elf) = image::coprocessor(NAME, scratch) else { return };
    let rows = recordings::rows(&workspace().join("tools/data/simulated_drive.csv"));
    let steps: Vec<Step> =
        rows.iter().take(AT_REST).enumerate().map(|(number, row)| Step::from_row(number, row)).collect();
    for degrees in [0.0f32, 60.0, -34.0, 36.37] {
        let configuration = Configuration { latitude_deg: Some(degrees), ..Configuration::DEFAULT };
        let stored = Stored::default().record(&configuration);
        let mut board = stored.boot(&elf, connected::USARTS, scratch, NAME);
        let outcome = connected::run(&mut board, &configuration, &steps);
        let lines = &outcome.followed.lines;
        let rates: Vec<RateMessage> =
            connected::rates(lines, FOG_IDS[0]).map(|(_, rate)| rate).skip(10).collect();
        assert!(rates.iter().all(|rate| (rate.source, rate.quality) == (Source::EarthRate, Quality::Good)));
        let mean = rates.iter().filter_map(RateMessage::deg_per_sec).sum::<f64>() / rates.len() as f64;
        let reading =
            steps.iter().enumerate().skip(10).map(|(k, _)| f64::from(connected::fog_reading(k, &rows[k])));
        // Ten readings in 10 ms.
        let read = (reading.sum::<f64>() / (AT_REST - 10) as f64 * 1_000.0).to_degrees();
        let earth = 15.041_07 / 3600.0 * f64::from(degrees).to_radians().sin();
        println!("{NAME}: {degrees} deg: read {read:.6} deg/s, sent {mean:.6} deg/s");
        // 1e-6 deg/s is 0.004 deg/h.
        assert!((read - earth - mean).abs() < 3e-6, "{degrees} deg: {read} less {earth} is not {mean}");
        let detail = connected::frames_with_id(lines, FOG_IDS[2]).last().expect("a detail message").1;
        let detail = DetailMessage::parse(detail.data()).expect("eight bytes");
        assert!((1..SIGMA_UNKNOWN - 1).contains(&detail.sigma), "{detail:?}");
    }
}
