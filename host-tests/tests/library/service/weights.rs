//! Weights are uploaded block by block, checked, and used after the next start.

use super::{Board, info, start};
use gyronet::model::weights;
use gyronet::service::message::Refusal;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Accepted, Slot};
use gyronet_host_tests::flash::{Cut, F405};
use gyronet_host_tests::stored::{open, other_weights};
use std::cell::RefCell;
use std::rc::Rc;

#[test]
fn weights_are_replaced() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let file = &weights::GYRONET.0;
    let crc = u32::from_le_bytes(*file.last_chunk().expect("a checksum"));
    for (round, slot) in [Slot::A, Slot::B, Slot::A].into_iter().enumerate() {
        let mut board = start(&flash);
        assert_eq!(board.weights_begin(file.len() as u32), Ok(()));
        for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
            let written = offset + block.len() as u32;
            assert_eq!(board.weights_block(offset, block), Ok(()));
            // The answer was lost: the same again does no harm.
            assert_eq!(board.weights_block(offset, block), Ok(()));
            if offset == 512 {
                let expected = Err(Refusal::Slot(SlotError::Offset { expected: written }));
                assert_eq!(board.weights_block(4096, &[]), expected);
                let early = Err(Refusal::Slot(SlotError::Incomplete { written }));
                assert_eq!(board.weights_verify(|_| ()), early);
                assert_eq!(board.weights_activate(), early);
            }
        }
        assert_eq!(board.uploaded(), None);
        assert_eq!(board.weights_verify(|_| ()), Ok(()));
        assert_eq!(board.uploaded(), Some((slot, crc)));
        assert_eq!(board.weights_activate(), Ok(()));
        let about = info(&mut start(&flash));
        assert_eq!((about.weights, about.weights_crc), (WeightSource::Slot(slot), Some(crc)), "{round}");
    }
    // A bad file is not accepted, and what ran before runs on.
    let mut board = start(&flash);
    assert_eq!(board.weights_begin(256), Ok(()));
    assert_eq!(board.weights_block(0, &[0x55; 256]), Ok(()));
    assert!(matches!(board.weights_verify(|_| ()), Err(Refusal::Slot(_))));
    assert!(matches!(board.weights_activate(), Err(Refusal::Slot(_))));
    assert_eq!(info(&mut start(&flash)).weights, WeightSource::Slot(Slot::A));
    // The slot in use damaged, and nothing accepted in the other: the built-in weights, and it is named.
    flash.borrow_mut().damage(Slot::A.offset() as usize + 70_000, 0x10);
    let mut board = start(&flash);
    let about = info(&mut board);
    assert_eq!(about.weights, WeightSource::BuiltIn);
    assert!(matches!(about.refused_slots, [Some(SlotError::Blob(_)), None]), "{:?}", about.refused_slots);
}

fn upload(board: &mut Board, file: &[u8]) {
    assert_eq!(board.weights_begin(file.len() as u32), Ok(()));
    for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
        assert_eq!(board.weights_block(offset, block), Ok(()));
    }
    assert_eq!(board.weights_verify(|_| ()), Ok(()));
}

/// The upload itself touches the unused slot alone (`store_power_cut`); here the board changes over to it.
#[test]
fn a_power_cut_during_activation_leaves_the_old_or_the_new_weights() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    upload(&mut board, &other_weights(1));
    assert_eq!(board.weights_activate(), Ok(()));
    let before = flash.borrow().clone();
    let mut cuts = 0;
    let changed_over = loop {
        let flash = Rc::new(RefCell::new(before.clone()));
        let mut board = start(&flash);
        upload(&mut board, &other_weights(2));
        flash.borrow_mut().cut_after(cuts, Cut::ALL[cuts as usize % Cut::ALL.len()]);
        let answer = board.weights_activate();
        if !flash.borrow_mut().restore() {
            break answer;
        }
        assert!(answer.is_err(), "cut {cuts}: {answer:?}");
        let weights = info(&mut start(&flash)).weights;
        assert!(matches!(weights, WeightSource::Slot(_)), "cut {cuts}: the board runs on weights {weights}");
        cuts += 1;
    };
    assert_eq!(changed_over, Ok(()));
    assert!(cuts > 3, "{cuts} operations to cut");
}

/// A checksum is no signature: four bytes of a file give it any.
#[test]
fn a_file_with_the_checksum_of_an_accepted_one_is_not_accepted_with_it() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let file = &weights::GYRONET.0[..];
    let mut board = start(&flash);
    for _ in 0..2 {
        upload(&mut board, file);
        assert_eq!(board.weights_activate(), Ok(()));
        board = start(&flash);
    }
    let accepted = || open(&flash).unwrap().get::<Accepted>().unwrap().unwrap();
    assert!(accepted().files.iter().all(Option::is_some));
    // The same bytes again, which nobody accepts.
    upload(&mut start(&flash), file);
    assert_eq!(accepted().files.iter().flatten().count(), 1, "the slot in use");
}

#[test]
fn an_upload_that_is_refused_erases_nothing() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    upload(&mut board, &weights::GYRONET.0);
    assert_eq!(board.weights_activate(), Ok(()));
    let (mut board, before) = (start(&flash), flash.borrow().operations());
    for length in [0, 3, u32::MAX] {
        assert_eq!(board.weights_begin(length), Err(Refusal::Slot(SlotError::Length(length))));
    }
    assert_eq!(flash.borrow().operations(), before);
}

/// FoGNet's file is refused under its own name by the client and at its old address, and by its topology at GyroNet's.
#[test]
fn a_file_of_fognet_is_refused() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let file = &weights::FOGNET.0;
    let too_long = Err(Refusal::Slot(SlotError::Length(file.len() as u32)));
    assert_eq!(start(&flash).weights_begin(file.len() as u32), too_long);
    // A small one.
    let mut board = start(&flash);
    let file = &file[..4096];
    assert_eq!(board.weights_begin(file.len() as u32), Ok(()));
    for (bytes, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
        assert_eq!(board.weights_block(offset, bytes), Ok(()));
    }
    let refused = board.weights_verify(|_| ());
    assert!(matches!(refused, Err(Refusal::Slot(SlotError::Blob(_) | SlotError::Length(_)))), "{refused:?}");
    let (_, mut bench) = super::uds::bench();
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x34, 0, 0x11, 1, 64], &[0x7F, 0x34, 0x31]);
    assert_eq!(bench.board.refusal(), Some(Refusal::FogNet));
    assert!(Refusal::FogNet.to_string().contains("FoGNet"));
}
