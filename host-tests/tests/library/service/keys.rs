//! The record of access: what damage, power cuts, relays and guesses do to it.

use super::Board;
use super::access::{SERIAL, a_key, content, locked, write};
use super::uds::{Bench, bench};
use gyronet::model::blob::CRC;
use gyronet::store::layout::STORE;
use gyronet::store::{Access, Configuration, Record, StoreError};
use gyronet_host_tests::flash::{Cut, Flash, shared};
use gyronet_host_tests::stored::open;
use gyronet_tools::signing::PrivateKey;
use std::ops::Range;

fn write_key(key: [u8; 32], trailer: &[u8]) -> Vec<u8> {
    [&[0x2E, 1, 0x10][..], &key, trailer].concat()
}

fn replace(bench: &mut Bench, [before, next]: [&PrivateKey; 2], counter: u32) {
    let trailer = before.trailer(0x0110, Some(SERIAL), counter, &next.public());
    bench.expect(&write_key(next.public(), &trailer), &[0x6E, 1, 0x10]);
}

fn challenge(bench: &mut Bench, number: u8) -> [u8; 32] {
    bench.seeds = vec![[number; 32]];
    bench.expect(&[0x27, 1], &[&[0x67, 1][..], &[number; 32]].concat());
    [number; 32]
}

fn answer(key: &PrivateKey, seed: [u8; 32]) -> Vec<u8> {
    [&[0x27, 2][..], &key.answer(&SERIAL, &seed)].concat()
}

/// The state of access: 0 open, 1 locked, 2 unlocked.
fn state(bench: &mut Bench) -> u8 {
    bench.ask(&[0x22, 1, 0x11]).expect("a response")[3]
}

/// The intact records of access in both sectors.
fn records(flash: &Flash) -> Vec<Range<usize>> {
    let bytes = flash.borrow().bytes().to_vec();
    let place = |at: usize| at..at + 8 + usize::from(bytes[at + 2]).next_multiple_of(4);
    let is_intact = |at: &usize| {
        let (content, crc) = bytes[place(*at)].split_last_chunk().expect("two words at least");
        bytes[*at] == Access::KEY && CRC.checksum(content).to_le_bytes() == *crc
    };
    (STORE.start as usize..STORE.end as usize).step_by(4).filter(is_intact).map(place).collect()
}

fn is_known(flash: &Flash, key: &PrivateKey) -> bool {
    super::start(flash).access().and_then(|access| access.key) == Some(key.public())
}

#[test]
fn a_challenge_is_answered_once_by_the_key_that_it_was_made_for() {
    let (_, mut bench, key) = locked();
    let next = a_key();
    let seed = challenge(&mut bench, 1);
    bench.expect(&answer(&next, seed), &[0x7F, 0x27, 0x35]);
    bench.expect(&answer(&key, seed), &[0x7F, 0x27, 0x24]);
    // The key changes while a challenge is open.
    let seed = challenge(&mut bench, 2);
    replace(&mut bench, [&key, &next], 1);
    for key in [&key, &next] {
        bench.expect(&answer(key, seed), &[0x7F, 0x27, 0x24]);
    }
    let seed = challenge(&mut bench, 3);
    bench.expect(&answer(&next, seed), &[0x67, 2]);
    bench.expect(&answer(&next, seed), &[0x7F, 0x27, 0x24]);
}

/// A signed key may have been recorded elsewhere: whoever sends it has proven nothing.
#[test]
fn a_relayed_key_gives_no_access_and_ends_that_of_the_key_before() {
    let (_, mut bench, key) = locked();
    let next = a_key();
    replace(&mut bench, [&key, &next], 1);
    assert_eq!(state(&mut bench), 1);
    bench.expect(&[0x14, 255, 255, 255], &[0x7F, 0x14, 0x33]);
    let seed = challenge(&mut bench, 1);
    bench.expect(&answer(&next, seed), &[0x67, 2]);
    replace(&mut bench, [&next, &key], 2);
    assert_eq!(state(&mut bench), 1);
}

#[test]
fn wrong_answers_of_others_do_not_keep_the_owner_out() {
    let (flash, mut bench, key) = locked();
    let other = a_key();
    for number in 1..=3 {
        let seed = challenge(&mut bench, number);
        assert!(bench.ask(&answer(&other, seed)).is_some_and(|response| response[0] == 0x7F));
        bench.stand();
    }
    bench.expect(&[0x27, 1], &[0x7F, 0x27, 0x37]);
    // What the owner signs is taken meanwhile, and the delay is over.
    let trailer = key.trailer(0x0100, Some(SERIAL), 1, &content(1));
    bench.expect(&write(&content(1), &trailer), &[0x6E, 1, 0]);
    let seed = challenge(&mut bench, 4);
    bench.expect(&answer(&key, seed), &[0x67, 2]);
    assert_eq!(super::start(&flash).access(), Some(Access { key: Some(key.public()), counter: 1, wrong: 0 }));
}

/// No byte of the flash changes while the vehicle moves, whatever is asked with a good key.
#[test]
fn nothing_is_written_in_motion_whoever_asks() {
    let (open, mut without_key) = bench();
    without_key.enter(3);
    let (flash, mut bench, key) = locked();
    let other = a_key();
    let seed = challenge(&mut bench, 1);
    [&mut bench, &mut without_key].into_iter().for_each(Bench::turn);
    without_key.expect(&write_key(key.public(), &[]), &[0x7F, 0x2E, 0x22]);
    assert_eq!(super::start(&open).access(), Some(Access::OPEN));
    let before = flash.borrow().operations();
    let signed = write(&content(1), &key.trailer(0x0100, None, 1, &content(1)));
    let next = write_key(other.public(), &key.trailer(0x0110, None, 1, &other.public()));
    for request in [signed, next, answer(&key, seed), answer(&other, seed)] {
        let response = bench.ask(&request).expect("a response");
        assert_eq!(response, [0x7F, request[0], 0x22]);
    }
    assert_eq!(flash.borrow().operations(), before);
}

#[test]
fn with_both_records_of_access_damaged_nobody_may_write() {
    let (flash, mut bench, key) = locked();
    let next = a_key();
    replace(&mut bench, [&key, &next], 1);
    let [first, second] = &records(&flash)[..] else { panic!("two") };
    let (whole, span) = (flash.borrow().clone(), first.len());
    for place in 0..span {
        for (first_place, second_place) in [(place, place), (place, span - 1 - place)] {
            let flash = shared(whole.clone());
            flash.borrow_mut().damage(first.start + first_place, 1 << (place % 8));
            flash.borrow_mut().damage(second.start + second_place, 1 << (place % 8));
            // At this start, and at those after the rest was moved to the other sector.
            for start in 0..3 {
                let mut board: Board = super::start(&flash);
                assert_eq!(board.access(), None, "byte {place} at start {start}");
                assert_eq!(board.info().stored_fault, Some(StoreError::Lost));
                assert_eq!(board.set_configuration(&Configuration::DEFAULT), Ok(()), "the device itself");
            }
            let mut bench = Bench::new(&flash);
            bench.enter(3);
            bench.expect(&write_key(key.public(), &[0; 69]), &[0x7F, 0x2E, 0x33]);
            bench.expect(&[0x27, 1], &[0x7F, 0x27, 0x33]);
        }
    }
}

/// Whatever single bit flips, the key stays: in headers, in other records, in what marks. Each start restores a record of
/// access from the other, so that then that one may be damaged.
#[test]
fn no_flipped_bit_opens_a_board_or_revives_a_key() {
    let (flash, mut bench, key) = locked();
    let next = a_key();
    replace(&mut bench, [&key, &next], 1);
    assert_eq!(records(&flash).len(), 2, "superseded ones are erased");
    let whole = flash.borrow().clone();
    let is_used = |at: &usize| whole.bytes()[*at] != 0xFF;
    for at in (STORE.start as usize..STORE.end as usize).filter(is_used) {
        for bit in 0..8 {
            let flash = shared(whole.clone());
            flash.borrow_mut().damage(at, 1 << bit);
            assert!(is_known(&flash, &next), "byte {at:#x} bit {bit}");
            let is_mended = open(&flash).is_ok_and(|store| !store.damaged());
            assert!(is_mended, "byte {at:#x} bit {bit}");
            let copies = records(&flash);
            assert!(copies.len() == 2, "byte {at:#x} bit {bit}: {copies:?}");
            flash.borrow_mut().damage(copies[bit % 2].start + 6, 0xFF);
            assert!(is_known(&flash, &next), "byte {at:#x} bit {bit}, and then the other copy");
        }
    }
}

/// A cut, or an older firmware, has left a single record.
#[test]
fn a_single_record_of_access_is_doubled_at_the_start() {
    let key = a_key();
    let (flash, access) = (Flash::default(), Access { key: Some(key.public()), ..Access::OPEN });
    open(&flash).and_then(|mut store| store.set(&Configuration::DEFAULT)).expect("it is stored");
    // Of the first record's eleven words, and of the next one.
    flash.borrow_mut().cut_after(11, Cut::Before);
    assert!(open(&flash).and_then(|mut store| store.set(&access)).is_err() && flash.borrow_mut().restore());
    assert_eq!(records(&flash).len(), 1);
    assert!(is_known(&flash, &key));
    assert_eq!(records(&flash).len(), 3, "two more");
}
