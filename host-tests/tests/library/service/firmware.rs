//! Firmware updates over diagnosis: what is refused before anything is erased, the trial, and the way back.

use super::uds::Bench;
use super::{Board, IDENTITY, start_from};
use gyronet::model::blob::CRC;
use gyronet::service::device::{Firmware, FirmwareState};
use gyronet::service::message::{BLOCK, Refusal};
use gyronet::store::Slot;
use gyronet::store::firmware::{FirmwareError, LABEL, Label, MAX_IMAGE, Trailer, select};
use gyronet::store::slots::SlotError;
use gyronet_host_tests::flash::{Flash, Region};
use gyronet_host_tests::stored::{flash_image, image};
use gyronet_tools::client::device::update::Update;
use gyronet_tools::signing::PrivateKey;
use std::rc::Rc;

const OWN: Label = Label::new([1, 2, 3], "a board");
const HEAD: u16 = 0x011A;

fn update(label: Label) -> Update {
    Update::new(label, [image(&label, 1), image(&label, 2)])
}

/// A flash with an image in slot A, and its board in a programming session at standstill.
fn board() -> (Flash, Bench) {
    let flash = Flash::default();
    flash_image(&flash, Slot::A, &image(&OWN, 9));
    assert_eq!(boot(&flash, false), Some(Slot::A));
    (Rc::clone(&flash), session(&flash, Slot::A))
}

fn boot(flash: &Flash, has_failed: bool) -> Option<Slot> {
    select(&mut Region::new(flash, 0..1 << 20), has_failed)
}

fn session(flash: &Flash, running: Slot) -> Bench {
    let mut bench = Bench::of(start_from(flash, Some(running)));
    bench.enter(2);
    bench
}

fn write_head(head: &[u8], trailer: &[u8]) -> Vec<u8> {
    [&[0x2E][..], &HEAD.to_be_bytes(), head, trailer].concat()
}

fn begin(length: u32) -> Vec<u8> {
    [&[0x34, 0, 0x44, 0, 0, 0, 2][..], &length.to_be_bytes()].concat()
}

fn send(bench: &mut Bench, image: &[u8]) -> Vec<u8> {
    bench.expect(&begin(image.len() as u32), &[0x74, 0x20, 1, 2]);
    for (block, number) in image.chunks(BLOCK).zip(1u8..) {
        bench.expect(&[&[0x36, number], block].concat(), &[0x76, number]);
    }
    bench.ask(&[0x37]).expect("a response")
}

fn refusal(bench: &Bench) -> Option<Refusal> {
    bench.board.refusal()
}

fn state(board: &Board) -> (Option<Slot>, FirmwareState) {
    let Firmware { slot, state, .. } = board.info().firmware;
    (slot, state)
}

/// Testers read that the first image in slot A runs, and how it stands to its update.
fn is_read(bench: &mut Bench, state: u8) {
    let crc = CRC.checksum(&image(&OWN, 9)).to_be_bytes();
    bench.expect(&[0x22, 1, 0x1A], &[&[0x62, 1, 0x1A, 0, state][..], &crc].concat());
}

#[test]
fn firmware_is_updated_tried_and_confirmed_and_the_next_one_goes_to_the_other_slot() {
    let (flash, mut bench) = board();
    is_read(&mut bench, 1);
    for (round, [from, to]) in [[Slot::A, Slot::B], [Slot::B, Slot::A]].into_iter().enumerate() {
        let update = update(Label { version: [1, 3, round as u8], ..OWN });
        bench.expect(&write_head(&update.head.bytes(), &[]), &[0x6E, 1, 0x1A]);
        let image = &update.images[to as usize];
        assert_eq!(send(&mut bench, image)[..2], [0x77, to as u8]);
        assert_eq!(boot(&flash, true), Some(from), "it is not activated yet");
        // What the old one has reached: samples and a window, no other node on the bus.
        assert!(!bench.board.firmware_trial(false, 3, 20_000));
        bench.expect(&[0x31, 1, 0xFF, 1], &[0x71, 1, 0xFF, 1]);
        assert_eq!(boot(&flash, true), Some(to));
        let place = to.firmware().start as usize;
        assert_eq!(flash.borrow().bytes()[place..place + image.len()], image[..]);
        bench = session(&flash, to);
        assert_eq!(state(&bench.board), (Some(to), FirmwareState::OnTrial));
        bench.expect(&write_head(&update.head.bytes(), &[]), &[0x7F, 0x2E, 0x22]);
        assert_eq!(refusal(&bench), Some(FirmwareError::OnTrial.into()), "the other is the way back");
        assert!(!bench.board.firmware_trial(false, 0, 16_000));
        assert_eq!(state(&bench.board).1, FirmwareState::OnTrial, "there was no window");
        assert!(!bench.board.firmware_trial(false, 1, 14_900), "too early");
        assert_eq!(state(&bench.board).1, FirmwareState::OnTrial);
        assert!(!bench.board.firmware_trial(false, 0, 16_000));
        assert_eq!(state(&bench.board), (Some(to), FirmwareState::Confirmed));
        assert_eq!(boot(&flash, true), Some(to), "a reset by the watchdog is no reason any more");
        bench = session(&flash, to);
        assert_eq!(state(&bench.board), (Some(to), FirmwareState::Confirmed));
    }
}

#[test]
fn an_update_that_reaches_less_or_is_damaged_gives_way_and_is_reported() {
    let (flash, mut bench) = board();
    let update = update(OWN);
    let try_on = |bench: &mut Bench| {
        bench.expect(&write_head(&update.head.bytes(), &[]), &[0x6E, 1, 0x1A]);
        assert_eq!(send(bench, &update.images[1])[0], 0x77);
        assert!(!bench.board.firmware_trial(true, 0, 1_000));
        bench.expect(&[0x31, 1, 0xFF, 1], &[0x71, 1, 0xFF, 1]);
        assert_eq!(boot(&flash, true), Some(Slot::B));
    };
    try_on(&mut bench);
    // The sensor is there, and nobody acknowledges.
    let mut on_trial = session(&flash, Slot::B);
    assert!(!on_trial.board.firmware_trial(false, 0, 59_000));
    assert!(on_trial.board.firmware_trial(false, 0, 60_000), "it gives up");
    assert_eq!(boot(&flash, false), Some(Slot::A), "by a reset of its own");
    // Now the one before runs from any start on, and says why.
    for _ in 0..3 {
        assert_eq!(boot(&flash, false), Some(Slot::A));
    }
    let mut bench = session(&flash, Slot::A);
    assert_eq!(state(&bench.board), (Some(Slot::A), FirmwareState::RolledBack));
    is_read(&mut bench, 3);
    let troubles = bench.ask(&[0x19, 2, 1]).expect("troubles");
    assert!(troubles[3..].chunks(4).any(|trouble| trouble[..3] == [0x5A, 0x03, 0x52]), "{troubles:02x?}");
    // Three starts without a confirmation are enough, too, when the supply fails in each.
    try_on(&mut bench);
    assert_eq!([(); 3].map(|()| boot(&flash, false)), [Some(Slot::B), Some(Slot::B), Some(Slot::A)]);
    // An image that has failed is better than none.
    let before = flash.borrow().clone();
    flash.borrow_mut().damage(Slot::A.firmware().start as usize + 1_000, 4);
    assert_eq!(boot(&flash, false), Some(Slot::B));
    *flash.borrow_mut() = before;
    // Confirmed, and then damaged.
    let mut bench = session(&flash, Slot::A);
    try_on(&mut bench);
    let mut on_trial = session(&flash, Slot::B);
    assert!(!on_trial.board.firmware_trial(true, 0, 15_000));
    assert_eq!(state(&on_trial.board).1, FirmwareState::Confirmed);
    flash.borrow_mut().damage(Slot::B.firmware().start as usize + 1_000, 4);
    assert_eq!(boot(&flash, false), Some(Slot::A));
    let bench = session(&flash, Slot::A);
    assert_eq!(state(&bench.board), (Some(Slot::A), FirmwareState::NewerDamaged));
    // And the other one too: nothing is started.
    flash.borrow_mut().damage(Slot::A.firmware().start as usize + 1_000, 4);
    assert_eq!(boot(&flash, false), None);
}

#[test]
fn what_cannot_be_right_is_refused_before_anything_is_erased() {
    let (flash, mut bench) = board();
    let key = PrivateKey::generate().expect("random numbers");
    bench.expect(&[&[0x2E, 1, 0x10][..], &key.public()].concat(), &[0x6E, 1, 0x10]);
    let other_key = PrivateKey::generate().expect("random numbers");
    let mut bench = session(&flash, Slot::A);
    let before = flash.borrow().bytes().to_vec();
    let right = update(OWN).head;
    let signed =
        |head: &[u8], key: &PrivateKey, counter| write_head(head, &key.trailer(HEAD, None, counter, head));
    let mut refused = |request: &[u8], code: u8, why: Option<Refusal>| {
        bench.expect(request, &[0x7F, request[0], code]);
        if why.is_some() {
            assert_eq!(refusal(&bench), why, "{request:02x?}");
        }
    };
    let mut too_long = right;
    too_long.images[1].length = MAX_IMAGE + 4;
    let labelled = |label| update(label).head.bytes();
    let firmware = |error: FirmwareError| Some(Refusal::from(error));
    for (head, why) in [
        (image(&OWN, 9)[..161].to_vec(), FirmwareError::NotAnUpdate),
        (right.bytes()[..160].to_vec(), FirmwareError::NotAnUpdate),
        (labelled(Label { board: *b"another board\0\0\0", ..OWN }).to_vec(), FirmwareError::Board),
        (labelled(Label { layout: 9, ..OWN }).to_vec(), FirmwareError::Layout { found: 9, expected: 1 }),
        (labelled(Label { version: [1, 2, 2], ..OWN }).to_vec(), FirmwareError::Older),
        (too_long.bytes().to_vec(), FirmwareError::Length(MAX_IMAGE + 4)),
    ] {
        refused(&signed(&head, &key, 5), 0x31, firmware(why));
    }
    refused(&write_head(&right.bytes(), &[]), 0x13, Some(Refusal::Unsigned));
    refused(&signed(&right.bytes(), &other_key, 5), 0x35, Some(Refusal::Signature));
    refused(&signed(&right.bytes(), &key, 0), 0x31, Some(Refusal::Counter { found: 0, newest: 0 }));
    let length = right.images[1].length;
    refused(&begin(length), 0x24, firmware(FirmwareError::NoHead));
    bench.expect(&signed(&right.bytes(), &key, 5), &[0x6E, 1, 0x1A]);
    bench.expect(&begin(length + 4), &[0x7F, 0x34, 0x31]);
    assert_eq!(refusal(&bench), firmware(FirmwareError::Length(length + 4)));
    bench.now += 5_001;
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    bench.expect(&begin(length), &[0x7F, 0x34, 0x24]);
    let slots = Slot::B.firmware().start as usize..Slot::A.firmware().end as usize;
    assert!(flash.borrow().bytes()[slots.clone()] == before[slots], "nothing is erased");
    // What runs, and what has no boot loader, is not overwritten.
    let alone = start_from(&flash, None).firmware_check(&OWN, false);
    assert_eq!(alone, Err(FirmwareError::NoBootLoader.into()));
    let own = start_from(&flash, Some(Slot::A)).firmware_begin(Slot::A, length);
    assert_eq!(own, Err(FirmwareError::NoBootLoader.into()));
    for length in [0, MAX_IMAGE - 1, MAX_IMAGE, MAX_IMAGE + 4] {
        let begun = start_from(&flash, Some(Slot::A)).firmware_begin(Slot::B, length);
        let refused = Err(FirmwareError::Length(length).into());
        assert_eq!(begun, if length == MAX_IMAGE { Ok(()) } else { refused });
    }
    // An older version is taken on request.
    let mut older = update(Label { version: [0, 9, 9], ..OWN }).head;
    older.downgrade = true;
    bench.expect(&signed(&older.bytes(), &key, 5), &[0x6E, 1, 0x1A]);
}

#[test]
fn an_interrupted_update_is_repeated_with_the_same_signature_once() {
    let (flash, mut bench) = board();
    let key = PrivateKey::generate().expect("random numbers");
    bench.expect(&[&[0x2E, 1, 0x10][..], &key.public()].concat(), &[0x6E, 1, 0x10]);
    let update = update(OWN);
    let head = update.head.bytes();
    let signed = write_head(&head, &key.trailer(HEAD, Some(IDENTITY.serial), 7, &head));
    let image = &update.images[1];
    // Interrupted; then blocks in the wrong order, one too many, and an image that was changed on the way.
    let mut bench = session(&flash, Slot::A);
    bench.expect(&signed, &[0x6E, 1, 0x1A]);
    bench.turn();
    bench.expect(&begin(image.len() as u32), &[0x7F, 0x34, 0x22]);
    assert_eq!(refusal(&bench), Some(Refusal::Moving), "and nothing is erased");
    assert_eq!(boot(&flash, true), Some(Slot::A));
    bench.stand();
    bench.expect(&begin(image.len() as u32), &[0x74, 0x20, 1, 2]);
    bench.expect(&[&[0x36, 1], &image[..BLOCK]].concat(), &[0x76, 1]);
    bench.expect(&[&[0x36, 3], &image[..BLOCK]].concat(), &[0x7F, 0x36, 0x73]);
    bench.expect(&[0x37], &[0x7F, 0x37, 0x24]);
    let mut bench = session(&flash, Slot::A);
    let mut changed = image.clone();
    changed[LABEL + 99] ^= 1;
    bench.expect(&signed, &[0x6E, 1, 0x1A]);
    assert_eq!(send(&mut bench, &changed), [0x7F, 0x37, 0x72]);
    assert_eq!(refusal(&bench), Some(FirmwareError::Content.into()));
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x7F, 0x31, 0x13]);
    assert_eq!(boot(&flash, false), Some(Slot::A));
    // The image for the other slot is not the right one either.
    assert_eq!(send(&mut bench, &update.images[0]), [0x7F, 0x37, 0x72]);
    assert_eq!(send(&mut bench, image)[..2], [0x77, 1]);
    bench.expect(&[&[0x36, 9], &image[..BLOCK]].concat(), &[0x7F, 0x36, 0x24]);
    // In motion nothing is written, and the signature is not used up.
    bench.turn();
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x7F, 0x31, 0x22]);
    bench.stand();
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x71, 1, 0xFF, 1]);
    assert_eq!(boot(&flash, true), Some(Slot::B));
    // Its counter is used up now.
    let mut on_trial = session(&flash, Slot::B);
    on_trial.expect(&signed, &[0x7F, 0x2E, 0x31]);
    assert_eq!(refusal(&on_trial), Some(Refusal::Counter { found: 7, newest: 7 }));
    let mut region = Region::new(&flash, 0..1 << 20);
    assert!(Trailer::read(&mut region, Slot::B).is_some_and(|trailer| trailer.number == 2));
}

#[test]
fn firmware_that_waits_for_its_activation_is_not_taken_for_weights() {
    let (flash, mut bench) = board();
    let update = update(OWN);
    bench.expect(&write_head(&update.head.bytes(), &[]), &[0x6E, 1, 0x1A]);
    assert_eq!(send(&mut bench, &update.images[1])[0], 0x77);
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x7F, 0x31, 0x24]);
    assert_eq!(bench.board.weights_verify(|_| ()), Err(SlotError::NotBegun.into()));
    assert_eq!(boot(&flash, true), Some(Slot::A));
    assert_eq!(bench.board.firmware_activate(), Ok(()), "which the device still knows");
}
