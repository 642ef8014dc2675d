//! Weights are uploaded block by block, checked, and used after the next start.

use super::{Board, ask, info, start};
use gyronet::model::weights;
use gyronet::service::Request;
use gyronet::service::message::Refusal;
use gyronet::store::Slot;
use gyronet::store::layout;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet_host_tests::flash::{Cut, F405};
use gyronet_host_tests::stored::other_weights;
use std::cell::RefCell;
use std::rc::Rc;

#[test]
fn weights_are_replaced() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let file = &weights::GYRONET.0;
    let crc = u32::from_le_bytes(*file.last_chunk().expect("a checksum"));
    for (round, slot) in [Slot::A, Slot::B, Slot::A].into_iter().enumerate() {
        let mut board = start(&flash);
        assert_eq!(ask(&mut board, &Request::WeightsBegin { length: file.len() as u32 }), Ok(()));
        for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
            let request = Request::WeightsBlock { offset, bytes: block };
            let written = offset + block.len() as u32;
            assert_eq!(ask(&mut board, &request), Ok(()));
            // The answer was lost: the same again does no harm.
            assert_eq!(ask(&mut board, &request), Ok(()));
            if offset == 512 {
                let gap = Request::WeightsBlock { offset: 4096, bytes: &[] };
                let expected = Err(Refusal::Slot(SlotError::Offset { expected: written }));
                assert_eq!(ask(&mut board, &gap), expected);
                let early = Err(Refusal::Slot(SlotError::Incomplete { written }));
                assert_eq!(ask(&mut board, &Request::WeightsVerify), early);
                assert_eq!(ask(&mut board, &Request::WeightsActivate), early);
            }
        }
        assert_eq!(board.uploaded(), None);
        assert_eq!(ask(&mut board, &Request::WeightsVerify), Ok(()));
        assert_eq!(board.uploaded(), Some((slot, crc)));
        assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
        let about = info(&mut start(&flash));
        assert_eq!((about.weights, about.weights_crc), (WeightSource::Slot(slot), Some(crc)), "{round}");
    }
    // A bad file is not accepted, and what ran before runs on.
    let mut board = start(&flash);
    assert_eq!(ask(&mut board, &Request::WeightsBegin { length: 256 }), Ok(()));
    assert_eq!(ask(&mut board, &Request::WeightsBlock { offset: 0, bytes: &[0x55; 256] }), Ok(()));
    assert!(matches!(ask(&mut board, &Request::WeightsVerify), Err(Refusal::Slot(_))));
    assert!(matches!(ask(&mut board, &Request::WeightsActivate), Err(Refusal::Slot(_))));
    assert_eq!(info(&mut start(&flash)).weights, WeightSource::Slot(Slot::A));
    // Both slots damaged: the built-in weights, and both are named.
    for slot in [Slot::A, Slot::B] {
        flash.borrow_mut().damage(layout::SLOTS.start as usize + slot.offset() as usize + 70_000, 0x10);
    }
    let mut board = start(&flash);
    let about = info(&mut board);
    assert_eq!(about.weights, WeightSource::BuiltIn);
    assert!(about.refused_slots.iter().all(Option::is_some), "{:?}", about.refused_slots);
}

/// Uploads a file and has it checked.
fn upload(board: &mut Board, file: &[u8]) {
    assert_eq!(ask(board, &Request::WeightsBegin { length: file.len() as u32 }), Ok(()));
    for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
        assert_eq!(ask(board, &Request::WeightsBlock { offset, bytes: block }), Ok(()));
    }
    assert_eq!(ask(board, &Request::WeightsVerify), Ok(()));
}

/// The upload itself touches the unused slot alone (`store_power_cut`); here the board changes over to it.
#[test]
fn a_power_cut_during_activation_leaves_the_old_or_the_new_weights() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    upload(&mut board, &other_weights(1));
    assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
    let before = flash.borrow().clone();
    let mut cuts = 0;
    let changed_over = loop {
        let flash = Rc::new(RefCell::new(before.clone()));
        let mut board = start(&flash);
        upload(&mut board, &other_weights(2));
        flash.borrow_mut().cut_after(cuts, Cut::ALL[cuts as usize % Cut::ALL.len()]);
        let answer = ask(&mut board, &Request::WeightsActivate);
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
