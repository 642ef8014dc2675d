//! The board stores records over used sectors and signed weight files, through diagnosis and the flash
//! controller, and works on while it erases as far as the part lets it.

use crate::common::{self, MS, START};
use crate::service::{self, at_latitude, on_bus};
use gyronet::can::DataFrame;
use gyronet::model::{Blob, weights};
use gyronet::service::message::{FlashState, Origin};
use gyronet::store::slots::WeightSource;
use gyronet::store::{Configuration, Learned, Slot};
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::replay;
use gyronet_host_tests::stored::{crc, other_weights};
use gyronet_tools::client::device::upload::{Uploaded, upload};
use std::time::Duration;

/// Typical time of an erase of 16 KiB (DS8626 table 39), and what the rest of a store may take.
const ERASE: Duration = Duration::from_millis(250);
const STORE_TIME: Duration = Duration::from_millis(70);
/// Half a period of the LED, which the image takes from its board time; the LED's pin.
const BLINK: Duration = Duration::from_millis(512);
const LED: u32 = 10;

fn timed<T>(board: &mut Board, work: impl FnOnce(&mut Board) -> T) -> (T, Duration) {
    let begin = board.counts().time;
    let result = work(board);
    (result, board.counts().time - begin)
}

/// Sectors that were erased, and causes of resets.
fn erased_and_reset(board: &mut Board) -> (Vec<u64>, Vec<String>) {
    let (mut erased, mut resets) = (Vec::new(), Vec::new());
    for event in board.events() {
        match event.kind.as_str() {
            "flash_erase" => erased.extend(event.numbers("sectors")),
            "reset" => resets.push(event.text("cause").to_owned()),
            "flash_error" | "programmed_over" | "ignored_write" => panic!("{event:?}"),
            _ => {}
        }
    }
    (erased, resets)
}

#[test]
fn configuration_survives_restarts_while_sectors_fill_and_are_used_again() {
    /// Stores between two restarts.
    const STORES: usize = 40;
    let Some(mut board) = common::started() else { return };
    let (mut erased, mut resets) = erased_and_reset(&mut board);
    let numbered = |number: usize| at_latitude(number as f32 * 0.125);
    let mut stores = 0;
    while erased.len() < 4 {
        for _ in 0..STORES {
            stores += 1;
            let (stored, took) =
                timed(&mut board, |board| on_bus(board).set_configuration(&numbered(stores)));
            stored.unwrap_or_else(|error| panic!("store {stores}: {error}"));
            let (sectors, causes) = erased_and_reset(&mut board);
            let least = ERASE * sectors.len() as u32;
            assert!((least..least + STORE_TIME).contains(&took), "store {stores}: {took:?}, {sectors:?}");
            erased.extend(sectors);
            assert_eq!(causes, Vec::<String>::new(), "store {stores}");
        }
        service::restart(&mut board);
        assert_eq!(service::configuration(&mut board), numbered(stores), "store {stores}");
        let info = service::info(&mut board);
        assert_eq!((info.configuration, info.flash), (Origin::Stored, FlashState::Ready));
        // A start with little room left erases too.
        let (sectors, causes) = erased_and_reset(&mut board);
        erased.extend(sectors);
        resets.extend(causes);
    }
    println!("{stores} stores, sectors erased: {erased:?}");
    assert_eq!(erased[..4], [1, 2, 1, 2]);
    assert_eq!(resets[0], "por");
    assert!(resets[1..].iter().all(|cause| cause == "software"), "{resets:?}");
}

#[test]
fn stale_error_flags_of_the_flash_controller_refuse_no_store() {
    /// OPERR, WRPERR, PGAERR, PGPERR and PGSERR of FLASH_SR, as an operation before this image may leave them.
    const ERRORS: u32 = 0xF2;
    let Some(mut board) = common::started() else { return };
    board.configure("FLASH.error_flags", ERRORS);
    on_bus(&mut board).set_configuration(&at_latitude(3.0)).expect("it is stored");
    board.configure("FLASH.error_flags", ERRORS);
    on_bus(&mut board).set_configuration(&at_latitude(4.0)).expect("no sector is erased");
    service::restart(&mut board);
    assert_eq!(service::configuration(&mut board), at_latitude(4.0));
}

#[test]
fn board_time_goes_on_over_an_erase() {
    let Some(mut board) = common::boot() else { return };
    board.configure("GPIOA.watch", vec![LED]);
    board.run(START + 2 * BLINK);
    // The first store erases a sector, whatever is in it.
    let (stored, took) = timed(&mut board, |board| on_bus(board).set_configuration(&at_latitude(1.0)));
    stored.expect("it is stored");
    assert!(took > ERASE);
    board.run(3 * BLINK);
    let events = board.events();
    let erase = common::times("flash_erase", &events)[0];
    let edges = common::times("pin", &events);
    let first = edges[0];
    println!("edges {edges:?}, erase at {erase:?}");
    let late = |time: Duration| (time - first).as_micros() % BLINK.as_micros();
    let stalled = |time: &Duration| (erase..erase + ERASE + MS).contains(time);
    for edge in edges.iter().filter(|time| !stalled(time)) {
        let late = late(*edge + MS);
        assert!(late <= 2 * MS.as_micros(), "edge at {edge:?}: {late} us");
    }
    assert!(edges.iter().filter(|time| **time > erase + ERASE + MS).count() >= 3);
}

#[test]
fn longest_erase_fits_the_watchdogs_limit_and_the_short_limit_returns() {
    let Some(mut board) = common::unpowered() else { return };
    // The slowest flash and the fastest watchdog (DS8626 tables 39 and 34).
    board.configure("FLASH.time_factor", 2.0);
    board.configure("RCC.lsi_hz", 47_000);
    board.power_on();
    board.run(START);
    service::enter(&mut board, 2);
    let _ = erased_and_reset(&mut board);
    let (response, took) = timed(&mut board, |board| {
        service::send(board, &[0x34, 0, 0x11, 0, 64]);
        service::answer(board, Duration::from_secs(4))
    });
    assert_eq!(response, Some(vec![0x74, 0x20, 1, 2]));
    println!("a slot is erased in {took:?}");
    assert!(took >= Duration::from_secs(2));
    // The sensor's silence outlasts that of the erase, and is stored with the next request.
    board.run(Duration::from_millis(1_500));
    assert_eq!(service::ask(&mut board, &[0x22, 0xF1, 0x86]), [0x62, 0xF1, 0x86, 2]);
    assert_eq!(erased_and_reset(&mut board), (vec![10, 1], Vec::new()));
    // Idle hangs.
    board.patch(At::Symbol("idle::Idle::step"), &[0xFE, 0xE7]);
    let hung = board.counts().time;
    let reset =
        board.run_until("iwdg_expired", Duration::from_secs(1)).expect("the watchdog resets the board");
    assert!(reset - hung < 90 * MS, "{:?}", reset - hung);
}

#[test]
fn uploaded_weights_run_from_their_slot() {
    /// Samples: static initialisation takes three seconds, the first windows follow.
    const SAMPLES: usize = 400;
    let Some(mut board) = common::started() else { return };
    let file = other_weights(1);
    let crc = crc(&file);
    let key = service::lock(&mut board);
    let (done, took) = timed(&mut board, |board| {
        let mut device = service::by_owner(board, &key);
        let done = upload(&mut device, &file, |_| {});
        device.restart().expect("access is proven");
        board.run(START);
        done
    });
    assert_eq!(done.expect("it is signed"), Uploaded { slot: Slot::A, crc });
    println!("{} bytes, signed, running after {took:?}", file.len());
    assert!(took < Duration::from_secs(60), "{took:?}");
    assert_eq!(common::counters(&mut board).lines.frames_lost, 0);
    let info = service::info(&mut board);
    assert_eq!(
        (info.weights, info.weights_crc, info.flash),
        (WeightSource::Slot(Slot::A), Some(crc), FlashState::Ready)
    );
    // The key takes the first sector of the records.
    assert_eq!(erased_and_reset(&mut board), (vec![1, 10], vec!["por".to_owned(), "software".to_owned()]));
    let samples = common::drive(SAMPLES);
    let begin = board.counts().time;
    let _ = board.can_frames();
    common::send(&mut board, &samples, begin);
    board.run(common::SAMPLE * (SAMPLES as u32 + 1));
    let sent = common::frames(&board.can_frames());
    let host = |file: &[u8]| -> Vec<DataFrame> {
        let file: &'static [u8] = file.to_vec().leak();
        let blob = Blob::new_checked(file).expect("a weight file");
        let mut host = replay::Board::new(&Configuration::DEFAULT, &Learned::NOTHING, blob);
        host.push(&samples.concat());
        host.frames
    };
    let (new, old) = (host(&file), host(&weights::DEFAULT.0));
    assert!(sent.len() >= common::SET * (SAMPLES - 1), "{} frames", sent.len());
    assert!(sent == new[..sent.len()], "the frames are those of the new weights");
    assert!(sent != old[..sent.len()], "the old weights give others");
}
