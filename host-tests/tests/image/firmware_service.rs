//! The image's service line in QEMU, asked by the tool's own code: what it says of itself, what it
//! refuses without a flash controller (what is stored: `firmware_stored`), a flood of noise, a restart.

use gyronet::service::event::EventKind;
use gyronet::service::message::{FlashState, Info, Network, Origin, Refusal};
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Configuration, Field, FieldError, StoreError};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::qemu::SERVICE;
use gyronet_host_tests::{image, qemu, replay};
use gyronet_tools::client::device::error::DeviceError;
use gyronet_tools::client::device::upload::upload;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);
const IMU: usize = 1;
const SLCAN: usize = 2;
/// Frames of one sample.
const SET: usize = 6;

fn boot(test: &str) -> Option<(qemu::Board, qemu::Tester)> {
    let elf = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR"))?;
    let mut board = qemu::Board::boot(&elf, SERVICE, &[]);
    let device = board.device(LIMIT);
    Some((board, device))
}

fn info(device: &mut qemu::Tester) -> Info {
    device.info().expect("a response")
}

#[test]
fn a_board_with_nothing_stored_reports_that() {
    let Some((_board, mut device)) = boot("a_board_with_nothing_stored_reports_that") else { return };
    let about = info(&mut device);
    assert_eq!((about.flash, about.writable), (FlashState::Ready, false));
    assert_eq!(about.configuration, Origin::BuiltIn);
    assert_eq!(about.weights, WeightSource::BuiltIn);
    assert_eq!((about.identity.device_id, about.identity.crash), (None, None));
    let configuration = device.configuration().expect("a response");
    assert_eq!(configuration, Configuration::DEFAULT);
    let mut set = |configuration| match device.set_configuration(&configuration) {
        Err(DeviceError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    };
    assert_eq!(set(configuration), Refusal::Store(StoreError::NoFlash));
    let wild = Configuration { latitude_deg: Some(91.0), ..configuration };
    let range = FieldError::Range { field: Field::LatitudeDeg, value: 91.0, low: -90.0, high: 90.0 };
    assert_eq!(set(wild), Refusal::Store(StoreError::Field(range)));
    match upload(&mut device, Network::GyroNet, &[0; 64], |_| {}) {
        Err(DeviceError::Refused(Refusal::Slot(SlotError::NoFlash))) => {}
        other => panic!("{other:?}"),
    }
    let page = device.log(0).expect("a response");
    assert!(matches!(page.events[0].kind, EventKind::Started(_)), "{page:?}");
    // It starts again and answers again.
    device.restart().expect("a response");
    assert_eq!(info(&mut device), about);
}

#[test]
fn noise_on_the_service_line_changes_no_frame() {
    const NAME: &str = "noise_on_the_service_line_changes_no_frame";
    let Some((mut board, mut device)) = boot(NAME) else { return };
    let (mut noise, samples, rounds) = (Noise::new(6), 50, 20);
    let bytes = |round: usize| -> Vec<u8> {
        (round * samples..(round + 1) * samples).flat_map(|number| replay::turning(number, 0.001)).collect()
    };
    let all: Vec<u8> = (0..rounds).flat_map(bytes).collect();
    let expected = replay::lines(&all);
    for round in 0..rounds {
        board.send(IMU, &bytes(round), LIMIT);
        let flood: Vec<u8> = (0..1_000).map(|_| noise.byte()).collect();
        board.send(SERVICE, &flood, LIMIT);
    }
    // Every frame is as if nothing had come on the service line.
    let lines = board.lines(SLCAN, b'\r', rounds * samples * SET, LIMIT);
    replay::assert_same(&lines, &expected);
    // The question stands behind what is left of the flood.
    let until = Instant::now() + 2 * LIMIT;
    let answer =
        std::iter::repeat_with(|| device.counters()).find(|answer| answer.is_ok() || Instant::now() > until);
    match answer {
        Some(Ok(counters)) => {
            println!("{NAME}: {} frames, {counters:?}", lines.len());
            assert!(counters.lines.service_errors > 40, "{counters:?}");
            assert_eq!(counters.pipeline.samples as usize, rounds * samples);
        }
        other => panic!("{other:?}"),
    }
}
