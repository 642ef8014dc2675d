//! Firmware updates of the virtual NUCLEO-H563ZI, whose two banks of flash swap: download without a gap, trial, confirmation,
//! the way back from images that are bad, and cuts of the power at the accesses to flash and option bytes.

use crate::common::{MS, SAMPLE, gap, id, resets, stand};
use crate::nucleo::{boot, built};
use crate::service::{self, at_latitude, by_owner, on_bus};
use crate::update::Cuts;
use embedded_can::Frame;
use gyronet::can::DataFrame;
use gyronet::model::blob::CRC;
use gyronet::service::device::FirmwareState;
use gyronet::store::Slot;
use gyronet::store::banks::{BANK, IMAGE, TRAILER, spread};
use gyronet::store::firmware::{FirmwareError, Trailer};
use gyronet::store::layout::{BOOT_SIZE, FLASH_BASE};
use gyronet_host_tests::board::{At, Board};
use gyronet_tools::client::device::update::{Update, update};
use gyronet_tools::client::device::{Authority, Device};
use gyronet_tools::signing::PrivateKey;
use std::time::Duration;

const S: Duration = Duration::from_secs(1);
/// Time from power-on to diagnosis: a swap, both checks of the images, and a copy of the records.
const START: Duration = Duration::from_millis(500);
const CAN: u32 = 2;

fn firmware(board: &mut Board) -> (Option<Slot>, FirmwareState) {
    let firmware = on_bus(board).info().expect("a response").firmware;
    (firmware.slot, firmware.state)
}

/// Updates a board over CAN with a key, and returns what it sent meanwhile and how long that took.
fn update_with(
    board: &mut Board,
    file: &Update,
    key: &PrivateKey,
) -> (Vec<(Duration, DataFrame)>, Result<Slot, String>) {
    let mut log = Vec::new();
    let device = Device::new(board.logged_bus(&mut log), "the virtual board");
    let mut device = device.authorise(Authority::Key(key.clone()));
    let slot = update(&mut device, file, |_, _| ()).map_err(|error| error.to_string());
    drop(device);
    (log, slot)
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_is_updated_over_can_without_a_gap_and_keeps_its_records() {
    let Some(mut board) = boot(&[]) else { return };
    let (_, file) = built();
    board.run(START);
    on_bus(&mut board).set_configuration(&at_latitude(48.0)).expect("it stands");
    let key = service::lock(&mut board);
    assert_eq!(firmware(&mut board), (Some(Slot::A), FirmwareState::Confirmed));
    // To the other bank, and back to the first: an image and records are there already.
    for (round, (to, latitude)) in [(Slot::B, 49.0), (Slot::A, 50.0)].into_iter().enumerate() {
        stand(&mut board, 4_700 + 500 * round as u32);
        board.run(3 * S);
        let _ = (board.events(), board.can_frames());
        let begin = board.counts().time;
        let (log, slot) = update_with(&mut board, file, &key);
        assert_eq!(slot.expect("the owner's"), to);
        let took = board.counts().time - begin;
        let erased = board.events().iter().filter(|event| event.kind == "flash_erase").count();
        println!(
            "{} bytes in {took:.2?}, {erased} sectors erased, at most {:.2?} from one rate to the next",
            file.images[0].len(),
            gap(&log, 100)
        );
        assert!(took < 60 * S && gap(&log, 100) < SAMPLE + MS, "{took:?} {:?}", gap(&log, 100));
        assert!(round == 0 || erased >= 29, "the image before is erased");
        by_owner(&mut board, &key).restart().expect("it stands");
        board.run(30 * MS);
        let _ = board.can_frames();
        board.run(START);
        let reset = resets(&mut board)[0].0;
        let sent = board.can_frames();
        let first = sent.iter().find(|(_, frame)| frame.id() == id(0x1A0)).expect("rates").0;
        println!("first rate {:.0?} after the restart", first - reset);
        assert!(first - reset < 400 * MS);
        assert_eq!(firmware(&mut board), (Some(to), FirmwareState::OnTrial));
        assert_eq!(on_bus(&mut board).configuration().expect("a response"), at_latitude(latitude - 1.0));
        board.run(3 * S);
        let (_, refused) = update_with(&mut board, file, &key);
        let refused = refused.expect_err("it is on trial");
        assert!(refused.contains(&FirmwareError::OnTrial.to_string()), "{refused}");
        // Settings that are stored on trial are those of both images.
        by_owner(&mut board, &key).set_configuration(&at_latitude(latitude)).expect("it stands");
        let _ = board.can_frames();
        board.run(13 * S);
        println!("at most {:.2?} while it is confirmed", gap(&board.can_frames(), 100));
        assert_eq!(firmware(&mut board), (Some(to), FirmwareState::Confirmed));
        board.power_cycle(10 * MS, START);
        assert_eq!(firmware(&mut board), (Some(to), FirmwareState::Confirmed));
        assert_eq!(on_bus(&mut board).configuration().expect("a response"), at_latitude(latitude));
        assert_eq!(on_bus(&mut board).access().expect("a response").state, "locked");
    }
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_refuses_an_image_that_was_not_signed_and_none_where_no_boot_loader_is() {
    let Some(mut board) = boot(&[]) else { return };
    let (_, file) = built();
    board.run(START);
    let key = service::lock(&mut board);
    // Files without a head and cut off, and an image that is not the one of the head.
    assert!(Update::parse(&file.images[0]).is_err() && Update::parse(&file.bytes()[..99_999]).is_err());
    let mut changed = file.clone();
    changed.images[1][0x1_0000] ^= 1;
    let (_, refused) = update_with(&mut board, &changed, &key);
    assert!(refused.is_err(), "the received image is not the one that was signed");
    board.power_cycle(MS, START);
    assert_eq!(firmware(&mut board), (Some(Slot::A), FirmwareState::Confirmed));
    // Without the boot loader in the other bank a swap would start nothing.
    board.patch(At::Address(FLASH_BASE + BANK + BOOT_SIZE - 16), &[0; 16]);
    board.power_cycle(MS, START);
    assert_eq!(firmware(&mut board), (None, FirmwareState::Alone));
}

/// Writes an image to the other bank, to start on trial.
fn install(board: &mut Board, image: &[u8], expected: u32) {
    let trailer = Trailer::new(image.len() as u32, CRC.checksum(image), expected, 2);
    board.patch(At::Address(FLASH_BASE + BANK + IMAGE), image);
    board.patch(At::Address(FLASH_BASE + BANK + TRAILER), &spread(&trailer.bytes()));
}

/// A board whose image in the other bank is on trial from the next reset on, with other instructions at the beginning of a
/// function.
fn bad(function: &str, code: &[u8], expected: u32) -> Option<Board> {
    let mut board = boot(&[])?;
    board.run(START);
    on_bus(&mut board).set_configuration(&at_latitude(48.0)).expect("it stands");
    let mut image = built().1.images[1].clone();
    let at = (board.symbol(function).0 - FLASH_BASE - IMAGE) as usize;
    image[at..at + code.len()].copy_from_slice(code);
    install(&mut board, &image, expected);
    let _ = board.events();
    on_bus(&mut board).restart().expect("it stands");
    Some(board)
}

fn rolled_back(board: &mut Board) {
    for _ in 0..2 {
        board.run(START);
        assert_eq!(firmware(board), (Some(Slot::A), FirmwareState::RolledBack));
        assert_eq!(on_bus(board).configuration().expect("a response"), at_latitude(48.0));
        board.power_cycle(10 * MS, Duration::ZERO);
    }
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_goes_back_from_an_image_that_hangs_or_resets_itself() {
    const HANG: &[u8] = &[0xFE, 0xE7];
    const UNDEFINED: &[u8] = &[0, 0xDE];
    // It writes SYSRESETREQ to AIRCR.
    const RESET: &[u8] = &[
        0x4E, 0xF6, 0x0C, 0x50, 0xCE, 0xF2, 0x00, 0x00, 0x40, 0xF2, 0x04, 0x01, 0xC0, 0xF2, 0xFA, 0x51, 0x01,
        0x60, 0xFE, 0xE7,
    ];
    // Its first instruction, its start, its task, which calls that function after two seconds without wheels.
    for (function, code, causes) in [
        ("Reset", HANG, &["software", "iwdg", "software"][..]),
        ("store::firmware::Trailer::read", HANG, &["software", "iwdg", "software"]),
        ("can::wheel::WheelReceiver::poll", HANG, &["software", "iwdg", "software"]),
        ("can::wheel::WheelReceiver::poll", UNDEFINED, &["software", "iwdg", "software"]),
        ("can::wheel::WheelReceiver::poll", RESET, &["software"; 5]),
    ] {
        let Some(mut board) = bad(function, code, 0) else { return };
        board.run(12 * S);
        let found: Vec<String> = resets(&mut board).into_iter().map(|(_, cause)| cause).collect();
        // The restart, then one for each swap and each failure.
        assert_eq!(found[0], "software", "{function}");
        assert_eq!(found[1..], *causes, "{function}");
        rolled_back(&mut board);
    }
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_goes_back_from_an_image_without_can_after_its_trial() {
    // bx lr
    let Some(mut board) = bad("can::CanBus::transmit", &[0x70, 0x47], CAN) else { return };
    board.run(59 * S);
    assert_eq!(resets(&mut board).len(), 2, "the restart and the swap");
    board.run(2 * S);
    assert_eq!(resets(&mut board).len(), 2, "the end of the trial and the swap");
    rolled_back(&mut board);
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_whose_image_is_damaged_starts_the_other_one_and_without_any_flashes() {
    let Some(mut board) = boot(&[]) else { return };
    board.run(START);
    let image = &built().1.images[1];
    install(&mut board, image, 0);
    let own = Trailer::new(image.len() as u32, CRC.checksum(image), 0, 2);
    let confirmed = Trailer { is_confirmed: true, ..own };
    board.patch(At::Address(FLASH_BASE + BANK + TRAILER), &spread(&confirmed.bytes()));
    board.reset_pin();
    board.run(START);
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::Confirmed));
    // The image that runs is the lower one.
    let place = At::Address(FLASH_BASE + IMAGE + 100_000);
    let damage = |board: &mut Board| {
        let byte = board.read(place, 1)[0];
        board.patch(place, &[byte ^ 0x10]);
        board.power_cycle(10 * MS, START);
        let _ = (board.events(), board.bus_log());
    };
    damage(&mut board);
    assert_eq!(firmware(&mut board), (Some(Slot::A), FirmwareState::NewerDamaged));
    board.configure("GPIOB.watch", vec![0]);
    damage(&mut board);
    board.run(3 * S);
    let events = board.events();
    let count = |kind: &str| events.iter().filter(|event| event.kind == kind).count();
    println!("{} edges, {} resets in 3 s", count("pin"), count("reset"));
    assert!((8..=15).contains(&count("pin")) && count("options") == 0);
    assert_eq!(board.bus_log().len(), 0);
}

/// A reset leaves either value of the option bytes while they are changed; each start mends that.
#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_starts_after_a_reset_or_a_cut_at_any_time_of_a_swap() {
    let Some(mut board) = boot(&[]) else { return };
    board.run(START);
    install(&mut board, &built().1.images[1], 0);
    board.snapshot("installed");
    let mut outcomes = std::collections::BTreeSet::new();
    for at in (0..160).step_by(4) {
        for is_reset in [true, false] {
            board.restore("installed");
            board.reset_pin();
            // Near the change of the option bytes, after the checks of both images.
            board.run(Duration::from_millis(40) + MS * at / 2);
            let _ = board.events();
            if is_reset {
                board.reset_pin();
            } else {
                board.power_cycle(MS, Duration::ZERO);
            }
            board.run(START);
            let state = firmware(&mut board);
            outcomes.insert((at, is_reset, format!("{state:?}")));
            assert_eq!(state, (Some(Slot::B), FirmwareState::OnTrial), "{at} {is_reset}");
        }
    }
    println!("{} interruptions", outcomes.len());
}

/// Most accesses are polls while the controller is busy, so a few of them are any time of each step; `library::banks` cuts at
/// each operation.
#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_starts_an_image_after_a_cut_at_an_access_of_its_update() {
    let Some(mut board) = boot(&[]) else { return };
    let (_, file) = built();
    board.run(START);
    on_bus(&mut board).set_configuration(&at_latitude(48.0)).expect("it stands");
    // So that two sectors are erased, and the trailer's.
    install(&mut board, &file.images[1][..2_048], 0);
    board.patch(At::Address(FLASH_BASE + BANK + TRAILER), &spread(&[0; 64]));
    let starts = |board: &mut Board| {
        board.run(200 * MS);
        let Ok(info) = on_bus(board).info() else { return false };
        assert_eq!(on_bus(board).configuration().expect("it answered"), at_latitude(48.0));
        info.firmware.slot.is_some()
    };
    let (delays, times) = (&[Duration::ZERO, Duration::from_micros(50)], [START, 14_200 * MS]);
    Cuts { most: 12, delays, starts: &starts, times, install, firmware }.update(&mut board, file);
}
