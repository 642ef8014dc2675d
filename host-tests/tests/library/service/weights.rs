//! Weights are uploaded block by block, checked, and used after the next start.

use super::{Board, ask, info, start};
use gyronet::model::weights;
use gyronet::service::message::Refusal;
use gyronet::service::{Reply, Request};
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
    let file = &weights::DEFAULT.0;
    let crc = u32::from_le_bytes(*file.last_chunk().expect("a checksum"));
    for (round, slot) in [Slot::A, Slot::B, Slot::A].into_iter().enumerate() {
        let mut board = start(&flash);
        let at = |written, checked| Reply::Weights { slot, written, checked };
        assert_eq!(ask(&mut board, &Request::WeightsBegin { length: file.len() as u32 }), at(0, None));
        for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
            let bytes = heapless::Vec::from_slice(block).expect("a block");
            let request = Request::WeightsBlock { offset, bytes };
            let written = offset + block.len() as u32;
            assert_eq!(ask(&mut board, &request), at(written, None));
            // The answer was lost: the same again does no harm.
            assert_eq!(ask(&mut board, &request), at(written, None));
            if offset == 512 {
                let gap = Request::WeightsBlock { offset: 4096, bytes: heapless::Vec::new() };
                let expected = Reply::Refused(Refusal::Slot(SlotError::Offset { expected: written }));
                assert_eq!(ask(&mut board, &gap), expected);
                let early = Reply::Refused(Refusal::Slot(SlotError::Incomplete { written }));
                assert_eq!(ask(&mut board, &Request::WeightsVerify), early);
                assert_eq!(ask(&mut board, &Request::WeightsActivate), early);
            }
        }
        assert_eq!(ask(&mut board, &Request::WeightsVerify), at(file.len() as u32, Some(crc)));
        assert_eq!(ask(&mut board, &Request::WeightsActivate), Reply::Done);
        let about = info(&mut start(&flash));
        assert_eq!((about.weights, about.weights_crc), (WeightSource::Slot(slot), Some(crc)), "{round}");
    }
    // A bad file is not accepted, and what ran before runs on.
    let mut board = start(&flash);
    ask(&mut board, &Request::WeightsBegin { length: 256 });
    let bytes = heapless::Vec::from_slice(&[0x55; 256]).expect("a block");
    ask(&mut board, &Request::WeightsBlock { offset: 0, bytes });
    assert!(matches!(ask(&mut board, &Request::WeightsVerify), Reply::Refused(Refusal::Slot(_))));
    assert!(matches!(ask(&mut board, &Request::WeightsActivate), Reply::Refused(Refusal::Slot(_))));
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

/// Uploads a file over the line and has it checked.
fn upload(board: &mut Board, file: &[u8]) {
    ask(board, &Request::WeightsBegin { length: file.len() as u32 });
    for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
        let bytes = heapless::Vec::from_slice(block).expect("a block");
        ask(board, &Request::WeightsBlock { offset, bytes });
    }
    let checked = ask(board, &Request::WeightsVerify);
    assert!(matches!(checked, Reply::Weights { checked: Some(_), .. }), "{checked:?}");
}

/// The upload itself touches the unused slot alone (`store_power_cut`); here the board changes over to it.
#[test]
fn a_power_cut_during_activation_leaves_the_old_or_the_new_weights() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    upload(&mut board, &other_weights(1));
    assert_eq!(ask(&mut board, &Request::WeightsActivate), Reply::Done);
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
        assert!(matches!(answer, Reply::Refused(_)), "cut {cuts}: {answer:?}");
        let weights = info(&mut start(&flash)).weights;
        assert!(matches!(weights, WeightSource::Slot(_)), "cut {cuts}: the board runs on weights {weights}");
        cuts += 1;
    };
    assert_eq!(changed_over, Reply::Done);
    assert!(cuts > 3, "{cuts} operations to cut");
}
