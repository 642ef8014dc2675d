//! Records and weights in the flash of the emulated image: a configuration and weights take effect, damaged ones do
//! not, and the bus and the service line report that from the first frame on. Every frame is held
//! against the host's, byte for byte.

use embedded_can::{Frame, Id, StandardId};
use gyronet::can::config::{Settings, YawSettings};
use gyronet::can::yaw::{AngleMessage, FOG_IDS, Faults, Quality, RateMessage, Source};
use gyronet::can::{DataFrame, slcan};
use gyronet::health::Status;
use gyronet::model::{Blob, weights};
use gyronet::service::event::{EventKind, SensorFault};
use gyronet::service::message::{FlashState, Info, Network, Origin, Refusal};
use gyronet::store::layout::{SLOT_SIZE, STORE};
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Configuration, FieldError, FogPart, ImuPart, Mounting, Slot, StoreError};
use gyronet_host_tests::connected::{self, Step};
use gyronet_host_tests::qemu::SERVICE;
use gyronet_host_tests::recordings::{self, workspace};
use gyronet_host_tests::stored::{Stored, other_weights};
use gyronet_host_tests::{image, qemu, replay};
use gyronet_tools::client::device::error::DeviceError;
use gyronet_tools::client::device::upload::upload;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);
const IMU: usize = 1;
const SLCAN: usize = 2;
/// The number of samples by which the network corrects.
const SAMPLES: usize = 360;
const RATE: u16 = 0x1A0;

fn drive() -> Vec<u8> {
    replay::simulated_drive(0..SAMPLES).concat()
}

fn blob(file: Vec<u8>) -> Blob<'static> {
    let words: Vec<u32> = file.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    Blob::new_checked(bytemuck::cast_slice(Vec::leak(words))).expect("a weight file")
}

fn built_in() -> Blob<'static> {
    Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library")
}

/// The frames of a board that has run for [`SAMPLES`], and its service line.
struct Started {
    frames: Vec<DataFrame>,
    device: qemu::Tester,
    /// The board itself, which must run as long as it is asked.
    _board: qemu::Board,
}

impl Started {
    /// Starts a board with this flash and checks that it sends what the one on the host sends; `None` where it cannot
    /// be run.
    fn by(test: &str, stored: &Stored, host: impl Fn() -> replay::Board) -> Option<Self> {
        let scratch = env!("CARGO_TARGET_TMPDIR");
        let elf = image::coprocessor(test, scratch)?;
        let mut board = stored.boot(&elf, SERVICE, scratch, test);
        let bytes = drive();
        let mut alone = host();
        alone.push(&bytes);
        board.send(IMU, &bytes, LIMIT);
        let lines = board.lines(SLCAN, b'\r', alone.lines.len(), LIMIT);
        let mut host = host().follow_lines(lines);
        host.push(&bytes);
        let lines = board.lines(SLCAN, b'\r', host.lines.len(), LIMIT);
        replay::assert_same(&lines, &host.lines);
        println!("{test}: {} frames as the host's", host.lines.len());
        let lines = &lines[..host.lines.len()];
        let frames = lines.iter().map(|line| slcan::parse(line).expect("a frame")).collect();
        let device = board.device(LIMIT);
        Some(Self { frames, device, _board: board })
    }

    fn of(&self, id: u16) -> impl Iterator<Item = &[u8]> {
        let id = Id::Standard(StandardId::new(id).expect("11 bits"));
        self.frames.iter().filter(move |frame| frame.id() == id).map(Frame::data)
    }

    fn rates(&self, id: u16) -> Vec<RateMessage> {
        self.of(id).map(|data| RateMessage::parse(data).expect("eight bytes")).collect()
    }

    /// Returns whether the messages report from the first sample's frames on, 10 ms, that something stored is damaged;
    /// they never do so for a part of the time.
    fn flagged(&self) -> bool {
        let faults = self.of(RATE + 1).map(|data| AngleMessage::parse(data).expect("eight bytes").faults);
        let flags: Vec<bool> = faults.map(|faults| faults.0 & Faults::STORED.0 != 0).collect();
        assert!(flags.windows(2).all(|pair| pair[0] == pair[1]) && flags.len() >= SAMPLES);
        flags[0]
    }

    /// Returns the number of samples whose rate has this quality.
    fn marked(&self, quality: Quality) -> usize {
        self.rates(RATE).iter().filter(|rate| rate.quality == quality).count()
    }

    fn info(&mut self) -> Info {
        self.device.info().expect("a response")
    }

    fn events(&mut self) -> Vec<EventKind> {
        let page = self.device.log(0).expect("a response");
        page.events.iter().map(|event| event.kind).collect()
    }
}

fn refusal<T: std::fmt::Debug>(result: Result<T, DeviceError>) -> Refusal {
    match result {
        Err(DeviceError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn stored_configuration_takes_effect() {
    const OTHER: u16 = 0x2B0;
    let yaw = Settings::DEFAULT.yaw.map(|yaw| YawSettings { ids: [OTHER, OTHER + 1, OTHER + 2], ..yaw });
    let configuration = Configuration {
        can: Settings { yaw, bosch: None, ..Settings::DEFAULT },
        mounting: Mounting { roll_deg: 0.0, pitch_deg: 0.0, yaw_deg: 90.0 },
        latitude_deg: Some(48.1),
        ..Configuration::DEFAULT
    };
    let stored = Stored::default().record(&configuration);
    let host = || replay::Board::configured(&configuration, built_in());
    let Some(mut board) = Started::by("stored_configuration_takes_effect", &stored, host) else { return };
    assert_eq!((board.of(RATE).count(), board.rates(OTHER).len() >= SAMPLES), (0, true));
    assert!(board.rates(OTHER).iter().any(|rate| rate.source == Source::GyroNet));
    let info = board.info();
    assert_eq!((info.flash, info.writable, info.configuration), (FlashState::Ready, false, Origin::Stored));
    // What is stored can be read without a controller, but not changed.
    let set = board.device.set_configuration(&configuration);
    assert_eq!(refusal(set), Refusal::Store(StoreError::NoFlash));
    let begun = upload(&mut board.device, Network::GyroNet, &[0; 64], |_| {});
    assert_eq!(refusal(begun), Refusal::Slot(SlotError::NoFlash));
}

#[test]
fn a_fibre_optic_gyro_is_sent_under_configured_identifiers() {
    const NAME: &str = "a_fibre_optic_gyro_is_sent_under_configured_identifiers";
    const OTHER: u16 = 0x3C0;
    let scratch = env!("CARGO_TARGET_TMPDIR");
    let Some(elf) = image::coprocessor(NAME, scratch) else { return };
    let configuration = Configuration { fog_ids: [OTHER, OTHER + 1, OTHER + 2], ..Configuration::DEFAULT };
    let mut board = Stored::default().record(&configuration).boot(&elf, connected::USARTS, scratch, NAME);
    let rows = recordings::rows(&workspace().join("tools/data/simulated_drive.csv"));
    let steps: Vec<Step> = rows.iter().take(50).enumerate().map(|(k, row)| Step::from_row(k, row)).collect();
    let outcome = connected::run(&mut board, &configuration, &steps);
    let sent = |id| connected::rates(&outcome.followed.lines, id).count();
    assert!(sent(OTHER) >= 48 && sent(FOG_IDS[0]) == 0, "{} {}", sent(OTHER), sent(FOG_IDS[0]));
}

#[test]
fn a_configured_fibre_optic_gyro_is_missed() {
    const NAME: &str = "a_configured_fibre_optic_gyro_is_missed";
    let configuration = Configuration { fog: Some(FogPart::Dsp1760), ..Configuration::DEFAULT };
    let stored = Stored::default().record(&configuration);
    let host = || replay::Board::configured(&configuration, built_in());
    let Some(board) = Started::by(NAME, &stored, host) else { return };
    // No byte of it has come; every 10 ms the bus says so.
    let rates = board.rates(FOG_IDS[0]);
    assert!(rates.len() >= SAMPLES - 2, "{}", rates.len());
    assert!(rates.iter().all(|rate| rate.quality == Quality::Unusable));
}

/// The configuration cannot be used: built-in values, the bus and the log say so, nothing is good.
fn lost(test: &str, stored: &Stored, flash: FlashState, event: EventKind) {
    let host = || replay::Board::new().damaged(true);
    let Some(mut board) = Started::by(test, stored, host) else { return };
    assert!(board.flagged());
    assert_eq!(board.marked(Quality::Good), 0);
    assert!(board.marked(Quality::Degraded) >= SAMPLES - 310, "it runs on");
    let info = board.info();
    assert_eq!(info.flash, flash);
    assert!(info.configuration != Origin::Stored, "{:?}", info.configuration);
    assert!(board.events().contains(&event), "{:?}", board.events());
}

#[test]
fn a_corrupt_configuration_is_reported_and_not_used() {
    let stored = Stored::default().record(&Configuration::DEFAULT).damaged(STORE.start + 20, 4);
    lost(
        "a_corrupt_configuration_is_reported_and_not_used",
        &stored,
        FlashState::Damaged,
        EventKind::RecordsDamaged,
    );
}

#[test]
fn a_corrupt_header_of_the_records_is_reported() {
    let stored = Stored::default().record(&Configuration::DEFAULT).damaged(STORE.start + 1, 0x80);
    lost(
        "a_corrupt_header_of_the_records_is_reported",
        &stored,
        FlashState::Damaged,
        EventKind::RecordsDamaged,
    );
}

#[test]
fn a_configuration_for_another_image_is_refused() {
    let other = Configuration { imu: ImuPart::Adis16465, ..Configuration::DEFAULT };
    let event = EventKind::ConfigurationRefused(StoreError::Field(FieldError::PartNotInImage));
    lost(
        "a_configuration_for_another_image_is_refused",
        &Stored::default().record(&other),
        FlashState::Ready,
        event,
    );
}

/// A part on SPI that does not answer (the emulator has none): it is named, there is no rate, and all
/// else goes on.
#[test]
fn a_part_on_spi_that_does_not_answer_is_named() {
    const NAME: &str = "a_part_on_spi_that_does_not_answer_is_named";
    const SETS: usize = 20;
    let scratch = env!("CARGO_TARGET_TMPDIR");
    let Some(elf) = image::coprocessor(NAME, scratch) else { return };
    let configuration = Configuration { imu: ImuPart::Icm42688, ..Configuration::DEFAULT };
    let mut board = Stored::default().record(&configuration).boot(&elf, SERVICE, scratch, NAME);
    // Nothing of an MTi is listened to.
    board.send(IMU, &drive()[..4_000], LIMIT);
    let _ = board.lines(SLCAN, b'\r', SETS * 6, LIMIT);
    board.send(SLCAN, b"V\r", LIMIT);
    let lines = board.lines_until(SLCAN, b'\r', LIMIT, |lines| lines.contains(&b"V0101".to_vec()));
    let mut host = replay::Board::new();
    host.silence(SETS as u64);
    let frames: Vec<Vec<u8>> = lines.into_iter().filter(|line| line.starts_with(b"t")).collect();
    assert_eq!(frames[..SETS * 6], host.lines[..]);
    let device = board.device(LIMIT);
    let frames = frames.iter().map(|line| slcan::parse(line).expect("a frame")).collect();
    let mut started = Started { frames, device, _board: board };
    assert!(started.rates(RATE).iter().all(|rate| rate.quality == Quality::Unusable));
    let info = started.info();
    assert_eq!((info.configuration, info.status), (Origin::Stored, Status::Silent));
    assert_eq!(info.sensor, Some(SensorFault::Identity(0)));
    // Once, though it is tried every second.
    let events = started.events();
    let named = |event: &&EventKind| **event == EventKind::Sensor(Some(SensorFault::Identity(0)));
    assert_eq!(events.iter().filter(named).count(), 1, "{events:?}");
}

/// Two files that differ from each other and from the built-in one.
fn files() -> [Vec<u8>; 2] {
    [other_weights(0x10), other_weights(0x20)]
}

/// A byte of the weights in a slot.
fn in_slot(slot: Slot) -> u32 {
    slot.offset() + SLOT_SIZE as u32 / 2
}

/// Returns the lines that a board on these weights sends.
fn lines_on(blob: Blob<'static>) -> Vec<Vec<u8>> {
    let mut host = replay::Board::configured(&Configuration::DEFAULT, blob);
    host.push(&drive());
    host.lines
}

#[test]
fn stored_weights_are_used() {
    let [a, b] = files();
    let [of_a, of_b, of_none] = [blob(a.clone()), blob(b.clone()), built_in()].map(lines_on);
    assert!(of_a != of_b && of_b != of_none && of_a != of_none, "whose weights they are can be seen");
    let stored = Stored::default().weights(Slot::A, &a).weights(Slot::B, &b);
    let host = || replay::Board::configured(&Configuration::DEFAULT, blob(b.clone()));
    let Some(mut board) = Started::by("stored_weights_are_used", &stored, host) else { return };
    assert!(!board.flagged());
    assert_eq!(board.info().weights, WeightSource::Slot(Slot::B));
}

#[test]
fn a_corrupt_slot_gives_way_to_the_other() {
    let [a, b] = files();
    let stored = Stored::default().weights(Slot::A, &a).weights(Slot::B, &b);
    let host = || replay::Board::configured(&Configuration::DEFAULT, blob(a.clone())).damaged(false);
    let stored = stored.damaged(in_slot(Slot::B), 0x10);
    let Some(mut board) = Started::by("a_corrupt_slot_gives_way_to_the_other", &stored, host) else { return };
    assert!(board.flagged());
    // These weights were accepted once and are whole: their rates are good.
    assert!(board.marked(Quality::Good) > 0);
    let info = board.info();
    assert_eq!(info.weights, WeightSource::Slot(Slot::A));
    assert!(matches!(info.refused_slots, [None, Some(SlotError::Blob(_))]), "{:?}", info.refused_slots);
    assert!(board.events().iter().any(|event| matches!(event, EventKind::SlotRefused(Slot::B, _))));
}

#[test]
fn two_corrupt_slots_give_way_to_the_built_in_weights() {
    let [a, b] = files();
    let stored = Stored::default().weights(Slot::A, &a).weights(Slot::B, &b);
    let stored = stored.damaged(in_slot(Slot::A), 1).damaged(in_slot(Slot::B), 0x80);
    let host = || replay::Board::new().damaged(false);
    let Some(mut board) = Started::by("two_corrupt_slots_give_way_to_the_built_in_weights", &stored, host)
    else {
        return;
    };
    assert!(board.flagged());
    let info = board.info();
    assert_eq!((info.weights, info.weights_crc), (WeightSource::BuiltIn, Some(built_in().crc)));
    assert!(info.refused_slots.iter().all(Option::is_some), "{:?}", info.refused_slots);
    let refused = |event: &EventKind| matches!(event, EventKind::SlotRefused(..));
    assert_eq!(board.events().iter().filter(|event| refused(event)).count(), 2);
}
