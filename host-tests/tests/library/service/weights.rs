//! Weights are uploaded block by block, checked, and used after the next start.

use super::{Board, ask, info, start};
use gyronet::fog::{FogNetUse, GyroMismatch};
use gyronet::model::fognet_blob::{BlobError, FOGNET};
use gyronet::model::{FogBlob, weights};
use gyronet::service::Request;
use gyronet::service::message::{Network, Refusal};
use gyronet::store::layout;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Accepted, Configuration, FogLane, FogPart, Place, Slot};
use gyronet_host_tests::flash::{Cut, F405};
use gyronet_host_tests::stored::{open, other_weights};
use std::cell::RefCell;
use std::rc::Rc;

/// The request that begins the upload of a file.
fn begin(file: &[u8]) -> Request<'static> {
    let is_fognet = file[6..8] == FOGNET.to_le_bytes();
    let network = if is_fognet { Network::FogNet } else { Network::GyroNet };
    Request::WeightsBegin { network, length: file.len() as u32 }
}

#[test]
fn weights_are_replaced() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let file = &weights::GYRONET.0;
    let crc = u32::from_le_bytes(*file.last_chunk().expect("a checksum"));
    for (round, slot) in [Slot::A, Slot::B, Slot::A].into_iter().enumerate() {
        let mut board = start(&flash);
        assert_eq!(ask(&mut board, &begin(file)), Ok(()));
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
        assert_eq!(board.uploaded(), Some((Place::Slot(slot), crc)));
        assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
        let about = info(&mut start(&flash));
        assert_eq!((about.weights, about.weights_crc), (WeightSource::Slot(slot), Some(crc)), "{round}");
    }
    // A bad file is not accepted, and what ran before runs on.
    let mut board = start(&flash);
    assert_eq!(ask(&mut board, &Request::WeightsBegin { network: Network::GyroNet, length: 256 }), Ok(()));
    assert_eq!(ask(&mut board, &Request::WeightsBlock { offset: 0, bytes: &[0x55; 256] }), Ok(()));
    assert!(matches!(ask(&mut board, &Request::WeightsVerify), Err(Refusal::Slot(_))));
    assert!(matches!(ask(&mut board, &Request::WeightsActivate), Err(Refusal::Slot(_))));
    assert_eq!(info(&mut start(&flash)).weights, WeightSource::Slot(Slot::A));
    // The slot in use damaged, and nothing accepted in the other: the built-in weights, and it is named.
    flash.borrow_mut().damage(Slot::A.offset() as usize + 70_000, 0x10);
    let mut board = start(&flash);
    let about = info(&mut board);
    assert_eq!(about.weights, WeightSource::BuiltIn);
    assert!(matches!(about.refused_slots, [Some(SlotError::Blob(_)), None]), "{:?}", about.refused_slots);
}

/// Uploads a file and has it checked.
fn upload(board: &mut Board, file: &[u8]) {
    assert_eq!(ask(board, &begin(file)), Ok(()));
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

/// A configuration with FoGNet for the gyro with a number.
fn with_fognet(fognet: FogNetUse, fog: FogPart, fog_serial: u32) -> Configuration {
    let fog_lane = FogLane { fognet, ..FogLane::default() };
    Configuration { fog_lane, fog: Some(fog), fog_serial, ..Configuration::DEFAULT }
}

/// FoGNet's weights after a start with a configuration.
fn fognet(flash: &Rc<RefCell<F405>>, configuration: &Configuration) -> Option<Result<u32, SlotError>> {
    open(flash).and_then(|mut store| store.set(configuration)).expect("it is stored");
    info(&mut start(flash)).fognet
}

#[test]
fn fognets_weights_run_on_the_gyro_that_they_were_trained_for() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let trained = FogBlob::new_checked(&weights::FOGNET.0).expect("they come with the library");
    let (crc, training) = (trained.crc, trained.training);
    assert_eq!((training.serial, training.simulated), (1, true));
    let own = with_fognet(FogNetUse::Simulated, FogPart::Dsp1760, 1);
    assert_eq!(fognet(&flash, &own), Some(Err(SlotError::Empty)));
    let mut board = start(&flash);
    upload(&mut board, &weights::FOGNET.0);
    assert_eq!(board.uploaded(), Some((Place::FogNet, crc)));
    assert!(board.take_fognet_unavailable() && !board.take_fognet_unavailable(), "once");
    // It is there, but nobody has accepted it.
    assert_eq!(fognet(&flash, &own), Some(Err(SlotError::NotAccepted(crc))));
    let mut board = start(&flash);
    upload(&mut board, &weights::FOGNET.0);
    assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
    assert_eq!(fognet(&flash, &own), Some(Ok(crc)));
    assert_eq!(info(&mut start(&flash)).weights, WeightSource::BuiltIn, "GyroNet's are not touched");
    assert_eq!(fognet(&flash, &with_fognet(FogNetUse::Off, FogPart::Dsp1760, 1)), None);
    for (other, why) in [
        (
            with_fognet(FogNetUse::Simulated, FogPart::Dsp1760, 0),
            "trained for a simulated DSP-1760 number 1, the configuration has a DSP-1760 number 0",
        ),
        (
            with_fognet(FogNetUse::Simulated, FogPart::Dsp1760, 2),
            "trained for a simulated DSP-1760 number 1, the configuration has a DSP-1760 number 2",
        ),
        (
            with_fognet(FogNetUse::Recorded, FogPart::Dsp1760, 1),
            "trained on a simulated DSP-1760 number 1, which runs only where the configuration says Simulated",
        ),
    ] {
        let refused = fognet(&flash, &other).expect("it is asked for").expect_err("for another gyro");
        assert!(matches!(refused, SlotError::Gyro(GyroMismatch::Other { .. } | GyroMismatch::Simulated(_))));
        assert_eq!(refused.to_string(), why);
        assert!(start(&flash).stored_damaged(), "the status reports it");
    }
    flash.borrow_mut().damage(layout::FOGNET.start as usize + 300_000, 1);
    let damaged = fognet(&flash, &own).expect("it is asked for");
    assert!(matches!(damaged, Err(SlotError::Blob(BlobError::Crc { .. }))), "{damaged:?}");
    // GyroNet's file in FoGNet's place is refused.
    let file = &weights::GYRONET.0;
    let mut board = start(&flash);
    let length = file.len() as u32;
    assert_eq!(ask(&mut board, &Request::WeightsBegin { network: Network::FogNet, length }), Ok(()));
    for (bytes, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
        assert_eq!(ask(&mut board, &Request::WeightsBlock { offset, bytes }), Ok(()));
    }
    let refused = ask(&mut board, &Request::WeightsVerify);
    assert!(
        matches!(refused, Err(Refusal::Slot(SlotError::Blob(BlobError::Topology { .. })))),
        "{refused:?}"
    );
}

/// FoGNet's file has one place: a cut leaves the new file, or none that would run.
/// A checksum is no signature: four bytes of a file give it any.
#[test]
fn a_file_with_the_checksum_of_an_accepted_one_is_not_accepted_with_it() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let own = with_fognet(FogNetUse::Simulated, FogPart::Dsp1760, 1);
    let (fognets, gyronets) = (&weights::FOGNET.0[..], &weights::GYRONET.0[..]);
    let mut board = start(&flash);
    for file in [fognets, gyronets, gyronets] {
        upload(&mut board, file);
        assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
        board = start(&flash);
    }
    let accepted = |flash: &Rc<RefCell<F405>>| open(flash).unwrap().get::<Accepted>().unwrap().unwrap();
    assert!(accepted(&flash).files.iter().all(Option::is_some));
    assert!(fognet(&flash, &own).unwrap().is_ok());
    // The same bytes again, which nobody accepts.
    for file in [fognets, gyronets] {
        upload(&mut start(&flash), file);
    }
    assert!(matches!(fognet(&flash, &own), Some(Err(SlotError::NotAccepted(_)))));
    assert_eq!(accepted(&flash).files.iter().flatten().count(), 1, "the slot in use");
}

#[test]
fn an_upload_that_is_refused_stops_nothing() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let own = with_fognet(FogNetUse::Simulated, FogPart::Dsp1760, 1);
    let mut board = start(&flash);
    upload(&mut board, &weights::FOGNET.0);
    assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
    assert!(fognet(&flash, &own).unwrap().is_ok());
    let (mut board, before) = (start(&flash), flash.borrow().operations());
    let running = info(&mut board).fognet;
    for length in [0, 3, u32::MAX] {
        let request = Request::WeightsBegin { network: Network::FogNet, length };
        assert_eq!(ask(&mut board, &request), Err(Refusal::Slot(SlotError::Length(length))));
    }
    assert_eq!((info(&mut board).fognet, flash.borrow().operations()), (running, before));
    assert!(!board.take_fognet_unavailable());
    // One that begins stops it, and damage does.
    let request = Request::WeightsBegin { network: Network::FogNet, length: 64 };
    let mut damaged = start(&flash);
    damaged.fognet_damaged();
    assert_eq!(ask(&mut board, &request), Ok(()));
    for (mut board, why) in [(board, None), (damaged, running.and_then(Result::ok))] {
        let why = why.map_or(SlotError::Empty, SlotError::NotAccepted);
        assert_eq!(info(&mut board).fognet, Some(Err(why)));
        assert!(board.take_fognet_unavailable());
    }
}

#[test]
fn a_power_cut_during_the_upload_of_fognet_leaves_none() {
    let old = &weights::FOGNET.0;
    let crc = |file: &[u8]| u32::from_le_bytes(*file.last_chunk().expect("a checksum"));
    let mut new = old.to_vec();
    let end = new.len() - 4;
    // The network runs on other gains.
    new[104] ^= 1;
    let checksum = gyronet::model::blob::CRC.checksum(&new[..end]);
    new[end..].copy_from_slice(&checksum.to_le_bytes());
    let flash = Rc::new(RefCell::new(F405::default()));
    let own = with_fognet(FogNetUse::Simulated, FogPart::Dsp1760, 1);
    let mut board = start(&flash);
    upload(&mut board, old);
    assert_eq!(ask(&mut board, &Request::WeightsActivate), Ok(()));
    assert_eq!(fognet(&flash, &own), Some(Ok(crc(old))));
    let before = flash.borrow().clone();
    let replace = |flash: &Rc<RefCell<F405>>| {
        let mut board = start(flash);
        board.act(&begin(&new))?;
        for (bytes, offset) in new.chunks(256).zip((0u32..).step_by(256)) {
            board.act(&Request::WeightsBlock { offset, bytes })?;
        }
        board.act(&Request::WeightsVerify)?;
        board.act(&Request::WeightsActivate)
    };
    let begun = Rc::new(RefCell::new(before.clone()));
    assert_eq!(start(&begun).act(&begin(&new)), Ok(()));
    // First of all the record that the old file is accepted no more.
    let record = begun.borrow().operations() - before.operations() - 1;
    let whole = Rc::new(RefCell::new(before.clone()));
    assert_eq!(replace(&whole), Ok(()));
    let operations = whole.borrow().operations() - before.operations();
    // Five sectors, each erased when the file reaches it; another record at the end.
    let sectors = [0, 1, 4_097, 20_482, 53_251, 86_020].map(|after| record + after..record + after + 3);
    let (first, last) = (0..record, operations - 8..operations);
    for after in sectors.into_iter().chain([first, last]).flatten() {
        let cut = Cut::ALL[after as usize % Cut::ALL.len()];
        let flash = Rc::new(RefCell::new(before.clone()));
        flash.borrow_mut().cut_after(after, cut);
        assert!(replace(&flash).is_err(), "cut {cut:?} at operation {after} of {operations}");
        assert!(flash.borrow_mut().restore());
        let found = info(&mut start(&flash)).fognet.expect("it is asked for");
        let untouched = after < record && found == Ok(crc(old));
        assert!(untouched || found.is_err() || found == Ok(crc(&new)), "{cut:?} at {after}: {found:?}");
        let accepted = open(&flash).and_then(|mut store| store.get::<Accepted>()).expect("records are whole");
        assert!(accepted.is_some_and(|accepted| accepted.active.is_none()));
        // The board takes the file again.
        assert_eq!(replace(&flash), Ok(()));
        assert_eq!(fognet(&flash, &own), Some(Ok(crc(&new))));
    }
}
