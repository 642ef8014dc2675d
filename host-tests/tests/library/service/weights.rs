//! Weights are uploaded block by block, checked, and used after the next start.

use super::{Board, fresh, start};
use gyronet::model::weights;
use gyronet::service::message::Refusal;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Accepted, Slot};
use gyronet_host_tests::flash::Flash;
use gyronet_host_tests::stored::{crc, open};

#[test]
fn weights_are_replaced() {
    let flash = Flash::default();
    let file = &weights::GYRONET.0;
    for (round, slot) in [Slot::A, Slot::B, Slot::A].into_iter().enumerate() {
        let mut board = start(&flash);
        assert_eq!(upload(&mut board, file), Ok(()));
        assert_eq!(board.uploaded(), Some((slot, crc(file))));
        assert_eq!(board.weights_activate(), Ok(()));
        let about = start(&flash).info();
        assert_eq!(
            (about.weights, about.weights_crc),
            (WeightSource::Slot(slot), Some(crc(file))),
            "{round}"
        );
    }
    let mut board = start(&flash);
    assert_eq!(board.weights_begin(file.len() as u32), Ok(()));
    assert_eq!(board.upload_block(&file[..256]), Ok(()));
    let early = Err(Refusal::Slot(SlotError::Incomplete { written: 256 }));
    assert_eq!([board.weights_verify(|_| ()), board.weights_activate()], [early; 2]);
    assert_eq!(board.uploaded(), None);
    // A bad file is not accepted, and what ran before runs on.
    let mut board = start(&flash);
    let refused = upload(&mut board, &[0x55; 256]);
    assert!(matches!(refused, Err(Refusal::Slot(SlotError::Blob(_) | SlotError::Length(_)))), "{refused:?}");
    assert!(matches!(board.weights_activate(), Err(Refusal::Slot(_))));
    assert_eq!(start(&flash).info().weights, WeightSource::Slot(Slot::A));
    // The slot in use damaged, and nothing accepted in the other: the built-in weights, and it is named.
    flash.borrow_mut().damage(Slot::A.offset() as usize + 70_000, 0x10);
    let board = start(&flash);
    let about = board.info();
    assert_eq!(about.weights, WeightSource::BuiltIn);
    assert!(matches!(about.refused_slots, [Some(SlotError::Blob(_)), None]), "{:?}", about.refused_slots);
}

/// Sends a file in blocks, and has it checked.
pub fn upload(board: &mut Board, file: &[u8]) -> Result<(), Refusal> {
    board.weights_begin(file.len() as u32)?;
    file.chunks(256).try_for_each(|block| board.upload_block(block))?;
    board.weights_verify(|_| ())
}

/// A checksum is no signature: four bytes of a file give it any.
#[test]
fn a_file_with_the_checksum_of_an_accepted_one_is_not_accepted_with_it() {
    let flash = Flash::default();
    let file = &weights::GYRONET.0[..];
    let mut board = start(&flash);
    for _ in 0..2 {
        assert_eq!(upload(&mut board, file), Ok(()));
        assert_eq!(board.weights_activate(), Ok(()));
        board = start(&flash);
    }
    let accepted = || open(&flash).unwrap().get::<Accepted>().unwrap().unwrap();
    assert!(accepted().files.iter().all(Option::is_some));
    // The same bytes again, which nobody accepts.
    assert_eq!(upload(&mut start(&flash), file), Ok(()));
    assert_eq!(accepted().files.iter().flatten().count(), 1, "the slot in use");
}

#[test]
fn an_upload_that_is_refused_erases_nothing() {
    let (flash, mut board) = fresh();
    assert_eq!(upload(&mut board, &weights::GYRONET.0), Ok(()));
    assert_eq!(board.weights_activate(), Ok(()));
    let (mut board, before) = (start(&flash), flash.borrow().operations());
    for length in [0, 3, u32::MAX] {
        assert_eq!(board.weights_begin(length), Err(Refusal::Slot(SlotError::Length(length))));
    }
    assert_eq!(flash.borrow().operations(), before);
}

/// At its old address it is refused under its own name.
#[test]
fn a_file_of_fognet_is_refused() {
    let (_, mut bench) = super::uds::bench();
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x34, 0, 0x11, 1, 64], &[0x7F, 0x34, 0x31]);
    assert_eq!(bench.board.refusal(), Some(Refusal::FogNet));
    assert!(Refusal::FogNet.to_string().contains("FoGNet"));
}
