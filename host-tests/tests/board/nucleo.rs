//! `examples/nucleo` on the virtual NUCLEO-H563ZI: it sends what the host makes of the same samples on a bus with CAN FD, and
//! nothing old after the bus was away.

use crate::access;
use crate::common::{self, MS, SAMPLE, SET, drive, faults, frames, host, id};
use crate::service::{answer, ask, at_latitude, enter, on_bus, send, storing};
use crate::spi_sensors::FAULTS;
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::health::Faults;
use gyronet::service::event::ResetCause;
use gyronet::service::message::FlashState;
use gyronet::store::banks::{BANK, RECORDS, SECTOR};
use gyronet::store::layout::FLASH_BASE;
use gyronet::store::{Configuration, ImuPart};
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::replay;
use gyronet_tools::client::device::Authority;
use gyronet_tools::client::device::update::Update;
use gyronet_tools::signing::PrivateKey;
use gyronet_tools::target::firmware::{Linked, NUCLEO};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

const BEGIN: Duration = Duration::from_millis(100);
/// The records, in the second bank of the flash.
const STORED: u32 = FLASH_BASE + BANK + RECORDS;

pub fn built() -> &'static (PathBuf, Update) {
    static BUILT: OnceLock<(PathBuf, Update)> = OnceLock::new();
    BUILT.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("nucleo");
        let linked = Linked::build(NUCLEO, 2, &folder).unwrap_or_else(|error| panic!("{error}"));
        let elf = folder.join("nucleo.elf");
        let whole = linked.for_programmer().expect("it was linked for this");
        std::fs::write(&elf, whole).expect("there is room");
        (elf, linked.update().expect("it was linked for this too"))
    })
}

/// A board that has just been switched on, and will receive these samples.
pub fn boot(samples: &[Vec<u8>]) -> Option<Board> {
    let mut board = Board::of("stm32h563", &built().0)?;
    board.power_on();
    common::send(&mut board, samples, BEGIN);
    Some(board)
}

/// Puts something in each sector of the records, so that all are erased before their first use.
fn use_records(board: &mut Board) {
    for sector in 0..16 {
        board.patch(At::Address(STORED + SECTOR * (sector + 1) - 16), &[0x55; 16]);
    }
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_sends_what_the_host_makes_and_nothing_old() {
    const SAMPLES: usize = 450;
    const AWAY: usize = 40;
    const FD: usize = 64;
    let samples = drive(SAMPLES + 2 * AWAY);
    let Some(mut board) = boot(&samples) else { return };
    let made = host(&samples);
    for k in 0..SAMPLES / 2 {
        board.can_fd_send_at(0x300, &[k as u8; FD], BEGIN + SAMPLE * 2 * k as u32);
    }
    board.run(BEGIN + SAMPLE * SAMPLES as u32);
    let sent = frames(&board.can_frames());
    println!("{} frames", sent.len());
    assert_eq!(sent.len(), SET * SAMPLES);
    assert!(sent == made[..sent.len()], "in order, and the same");

    board.configure("FDCAN1.connected", false);
    board.run(SAMPLE * AWAY as u32);
    assert_eq!(board.can_frames().len(), 0);
    board.configure("FDCAN1.connected", true);
    board.run(SAMPLE * AWAY as u32);
    let sent = frames(&board.can_frames());
    let first = made.iter().position(|frame| *frame == sent[0]).expect("the host's");
    println!("sample {} is the first after {}", first / SET, SAMPLES + AWAY);
    assert!(first >= SET * (SAMPLES + AWAY - 3) && sent.len() > SET * (AWAY - 10));
    // Each frame was sent or is counted.
    let unsent = on_bus(&mut board).counters().expect("a response").lines.unsent as usize;
    assert_eq!(unsent, first - SET * SAMPLES);
}

fn rates(timed: Vec<(Duration, DataFrame)>) -> Vec<(Duration, DataFrame)> {
    let is_rate = |id| matches!(id, Id::Standard(id) if id.as_raw() < 0x700);
    timed.into_iter().filter(|(_, frame)| is_rate(frame.id())).collect()
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_stores_over_the_bus_without_a_gap() {
    const TIME: Duration = Duration::from_millis(1_500);
    let parked: Vec<_> = (0..600).map(|k| replay::turning(k, 0.0)).collect();
    let Some(mut board) = boot(&parked) else { return };
    use_records(&mut board);
    common::stop_wheels(&mut board, 600, BEGIN + 8 * MS);
    board.run(Duration::from_secs(4));
    let _ = board.can_frames();
    board.snapshot("parked");
    board.run(TIME);
    let undisturbed = board.can_frames();
    board.restore("parked");
    let mut configuration = Configuration::DEFAULT;
    let mut sent = Vec::new();
    for bits_per_second in [250_000, 1_000_000, 250_000] {
        configuration.can.bits_per_second = bits_per_second;
        send(&mut board, &[0x10, 0x03]);
        board.run(20 * MS);
        send(&mut board, &storing(&configuration));
        board.run(TIME / 4);
        sent.extend(board.can_frames());
    }
    let stored = sent.iter().filter(|(_, frame)| frame.id() == id(0x7E8) && frame.data()[1] == 0x6E);
    assert_eq!(stored.count(), 3);
    let erased = board.events().iter().filter(|event| event.kind == "flash_erase").count();
    let sent = rates(sent);
    let gap = sent.windows(2).map(|pair| pair[1].0 - pair[0].0).max().expect("frames");
    println!("{} frames, {erased} sectors erased, at most {gap:?} without a frame", sent.len());
    assert_eq!(erased, 8, "a sector of the records takes eight of the flash");
    assert!(gap < SAMPLE, "{gap:?}");
    let other = sent.iter().zip(&undisturbed).find(|((_, sent), (_, alone))| sent != alone);
    assert_eq!(other, None, "the same as without a store");

    board.power_cycle(MS, Duration::ZERO);
    board.configure("FDCAN1.bit_rate", configuration.can.bits_per_second);
    board.run(100 * MS);
    assert_eq!(on_bus(&mut board).configuration().expect("a response"), configuration);
    // The samples end, so that nothing forbids a restart.
    board.run(Duration::from_secs(1));
    send(&mut board, &[0x11, 1]);
    assert_eq!(answer(&mut board, 100 * MS), Some(vec![0x51, 1]));
    board.run(100 * MS);
    let info = on_bus(&mut board).info().expect("a response");
    assert_eq!((info.identity.reset, info.flash), (ResetCause::Software, FlashState::Ready));
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_hears_wheels_and_returns_from_bus_off_at_growing_intervals() {
    let samples = drive(400);
    let Some(mut board) = boot(&samples) else { return };
    let made = host(&samples);
    let last_faults =
        |board: &mut Board| *faults(&frames(&board.can_frames())).last().expect("an angle message");
    common::stop_wheels(&mut board, 50, BEGIN);
    board.run(BEGIN + 500 * MS);
    assert!(!last_faults(&mut board).contains(Faults::WHEELS));
    board.run(500 * MS);
    assert!(last_faults(&mut board).contains(Faults::WHEELS), "those that were heard are silent");

    let _ = board.events();
    board.configure("FDCAN1.short", "recessive");
    board.run(400 * MS);
    board.configure("FDCAN1.short", serde_json::Value::Null);
    let _ = board.can_frames();
    board.run(600 * MS);
    let back = common::back_at_growing_intervals(&board.events(), 129 * 11, 2 * MS);
    let sent = rates(board.can_frames());
    let (first, frame) = sent[0];
    assert!(first - back[5] < SAMPLE + 2 * MS, "{:?}", first - back[5]);
    let number = made.iter().position(|made| *made == frame).expect("the host's") / SET;
    let newest = ((first - BEGIN).as_millis() / SAMPLE.as_millis()) as usize;
    assert!(newest - number <= 1, "sample {number} at the time of {newest}");
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_takes_no_can_fd_and_starts_again_without_its_clock() {
    let Some(mut board) = boot(&[]) else { return };
    board.run(200 * MS);
    let session = [2, 0x10, 3, 0xCC, 0xCC, 0xCC, 0xCC, 0xCC];
    for id in [0xAA, 0x7E0] {
        for data in [&session[..], &[0x21; 64]] {
            let now = board.counts().time;
            (0..2).for_each(|_| board.can_fd_send_at(id, data, now));
            send(&mut board, &[0x3E, 0]);
            assert_eq!(answer(&mut board, 20 * MS), Some(vec![0x7E, 0]), "{id:#x}, {} bytes", data.len());
        }
    }

    board.configure("RCC.hse_hz", serde_json::Value::Null);
    board.power_cycle(MS, Duration::ZERO);
    assert!(board.run_until("iwdg_expired", Duration::from_millis(1_300)).is_some());
    board.configure("RCC.hse_hz", 8_000_000);
    board.run(Duration::from_millis(1_300));
    let info = on_bus(&mut board).info().expect("a response");
    assert_eq!((info.identity.reset, info.flash), (ResetCause::Watchdog, FlashState::Ready));
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_with_a_key_is_written_by_its_owner_alone() {
    let Some(mut board) = boot(&[]) else { return };
    board.run(200 * MS);
    let [key, other] = [(); 2].map(|()| PrivateKey::generate().expect("random numbers"));
    board.configure("RNG.seed_error", true);
    enter(&mut board, 3);
    let content = [&[0x2E, 0x01, 0x10][..], &key.public()].concat();
    assert_eq!(ask(&mut board, &content), [0x7F, 0x2E, 0x22], "without random numbers it would ask for none");
    board.configure("RNG.seed_error", false);
    on_bus(&mut board).set_key(&key.public()).expect("there was none");
    send(&mut board, &[0x11, 1]);
    board.run(300 * MS);
    access::fail_with_the_generator(&mut board);
    let configuration = at_latitude(1.0);
    let mut write = |authority| on_bus(&mut board).authorise(authority).set_configuration(&configuration);
    assert!(write(Authority::None).is_err() && write(Authority::Key(other)).is_err());
    write(Authority::Key(key)).expect("it is the owner's");
    board.power_cycle(MS, 100 * MS);
    assert_eq!(on_bus(&mut board).configuration().expect("a response"), configuration);
}

/// The configuration that a board has after a cut, and whether its records are damaged. A cut is one of the power, a reset, or
/// a second one while the start mends the records.
fn after_cut(board: &mut Board, cut: u32) -> (Configuration, FlashState) {
    if cut % 3 == 1 {
        board.reset_pin();
    } else {
        board.power_cycle(MS, Duration::ZERO);
    }
    if cut % 3 == 2 {
        board.run(MS * (cut + 1));
        board.power_cycle(MS, Duration::ZERO);
    }
    board.run(400 * MS);
    let configuration = on_bus(board).configuration().expect("it runs, and answers");
    (configuration, on_bus(board).info().expect("a response").flash)
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_survives_a_power_cut_at_any_time_of_a_store() {
    const CUTS: u32 = 20;
    let Some(mut board) = boot(&[]) else { return };
    use_records(&mut board);
    board.run(200 * MS);
    // The first store erases eight sectors, the second only appends.
    let (mut states, mut kept) = (Vec::new(), 0);
    for (old, new, step) in
        [(Configuration::DEFAULT, at_latitude(1.0), 2_100), (at_latitude(1.0), at_latitude(2.0), 1_000)]
    {
        send(&mut board, &[0x10, 0x03]);
        board.run(20 * MS);
        send(&mut board, &storing(&new));
        board.snapshot("storing");
        for cut in 0..CUTS {
            board.restore("storing");
            board.run(Duration::from_micros(u64::from(step * cut)));
            let (configuration, flash) = after_cut(&mut board, cut);
            assert!(configuration == old || configuration == new, "cut {cut}: {configuration:?}");
            kept += u32::from(configuration == old);
            states.push(flash);
        }
        board.restore("storing");
        board.run(100 * MS);
        assert_eq!(after_cut(&mut board, 0), (new, FlashState::Ready));
    }
    let damaged = states.iter().filter(|flash| **flash == FlashState::Damaged).count();
    println!("{} cuts, {kept} with the old settings, {damaged} with a damaged record", states.len());
    assert!(
        states.iter().all(|flash| matches!(flash, FlashState::Ready | FlashState::Damaged)),
        "{states:?}"
    );
    assert!((1..2 * CUTS).contains(&kept) && damaged > 0);
}

/// Known rates, deg/s, that a board sends in a second, and the number of all.
fn second_of_rates(board: &mut Board) -> (Vec<f64>, usize) {
    let _ = board.can_frames();
    board.run(Duration::from_secs(1));
    let rates = common::rates(&board.can_frames());
    (rates.iter().filter_map(|(_, rate)| rate.deg_per_sec()).collect(), rates.len())
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_reads_the_part_on_spi_that_is_configured() {
    for (part, model) in
        [(ImuPart::Icm42688, "Icm42688"), (ImuPart::Bmi088, "Bmi088"), (ImuPart::Asm330lhh, "Asm330lhh")]
    {
        let Some(mut board) = boot(&[]) else { return };
        board.configure("SPI1.part", model);
        board.run(200 * MS);
        on_bus(&mut board)
            .set_configuration(&Configuration { imu: part, ..Configuration::DEFAULT })
            .expect("it stands");
        on_bus(&mut board).restart().expect("it stands");
        // Its self-test is at rest.
        board.run(Duration::from_secs(1));
        board.configure("SPI1.imu_rates_dps", serde_json::json!([0.0, 0.0, 10.0]));
        board.run(500 * MS);
        let turning = |board: &mut Board| {
            let (rates, all) = second_of_rates(board);
            println!("{model}: {} of {all} rates are known", rates.len());
            assert!((99..=101).contains(&all) && rates.len() == all, "{} of {all}", rates.len());
            assert!(rates.iter().all(|rate| (rate - 10.0).abs() < 0.3), "{rates:?}");
            assert_eq!(on_bus(board).info().expect("a response").sensor, None);
        };
        turning(&mut board);
        board.configure("SPI1.fitted", false);
        board.run(500 * MS);
        assert!(second_of_rates(&mut board).0.is_empty());
        assert!(on_bus(&mut board).info().expect("a response").sensor.is_some());
        board.configure("SPI1.fitted", true);
        board.run(Duration::from_millis(1_500));
        turning(&mut board);
        let events = board.events();
        let faults = events.iter().filter(|event| FAULTS.contains(&&*event.kind));
        assert_eq!(faults.map(|event| &event.kind).collect::<Vec<_>>(), Vec::<&String>::new());
    }
}
