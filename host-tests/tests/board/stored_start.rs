//! Flash contents at the start, in order or damaged: the board runs on, and the bus and the service
//! line report it from the first frame on.

use crate::common::{self, SAMPLE, START, frames};
use crate::service::{self, on_bus};
use gyronet::can::DataFrame;
use gyronet::health::Faults;
use gyronet::service::message::{FlashState, Info, Origin, Refusal};
use gyronet::store::layout::{FLASH_BASE, SLOT_SIZE, STORE};
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Configuration, FlashFault, Slot, StoreError};
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::stored::{Stored, other_weights};
use gyronet_tools::client::device::error::DeviceError;
use std::time::Duration;

const SAMPLES: usize = 20;
/// Time from power-on until the image listens, where its start has mended a sector of the records.
const MENDED: Duration = START.saturating_add(Duration::from_millis(300));

/// A board that has run for [`SAMPLES`] with this flash.
struct Started {
    board: Board,
    frames: Vec<DataFrame>,
    info: Info,
}

impl Started {
    fn with(stored: &Stored, prepare: impl FnOnce(&mut Board)) -> Option<Self> {
        let mut board = common::unpowered()?;
        stored.write_to(&mut board);
        prepare(&mut board);
        board.power_on();
        common::send(&mut board, &common::drive(SAMPLES), MENDED);
        board.run(MENDED + SAMPLE * SAMPLES as u32);
        let frames = frames(&board.can_frames());
        let info = service::info(&mut board);
        Some(Self { board, frames, info })
    }

    /// True if the messages report damaged stored data: from the first one on, or never.
    fn flagged(&self) -> bool {
        let faults = common::faults(&self.frames).into_iter();
        let flags: Vec<bool> = faults.map(|faults| faults.contains(Faults::STORED)).collect();
        assert!(flags.len() >= SAMPLES - 1 && flags.windows(2).all(|pair| pair[0] == pair[1]), "{flags:?}");
        flags[0]
    }
}

/// What a start makes of each damage is in `library::service::configuration` and `weights`; here the image reports it.
#[test]
fn a_damaged_configuration_and_a_damaged_slot_give_way_and_are_reported() {
    let [a, b] = [other_weights(0x10), other_weights(0x20)];
    let stored = Stored::default().record(&Configuration::DEFAULT).weights(Slot::A, &a).weights(Slot::B, &b);
    let inside = Slot::B.offset() + SLOT_SIZE as u32 / 2;
    let stored = stored.damaged(STORE.start + 20, 4).damaged(inside, 0x10);
    let Some(started) = Started::with(&stored, |_| ()) else { return };
    assert!(started.flagged());
    let info = started.info;
    assert_eq!((info.flash, info.weights), (FlashState::Damaged, WeightSource::Slot(Slot::A)));
    assert_ne!(info.configuration, Origin::Stored);
    assert!(matches!(info.refused_slots, [None, Some(SlotError::Blob(_))]), "{:?}", info.refused_slots);
}

/// A controller that a reset does not lock is a fault: what is stored is read, and nothing is written. That the gate of the
/// standstill holds as ever is in `library::service::configuration`.
#[test]
fn nothing_is_written_with_an_unlocked_flash_controller() {
    let configuration = service::at_latitude(48.1);
    let stored = Stored::default().record(&configuration);
    let unlocked = |board: &mut Board| board.configure("FLASH.starts_unlocked", true);
    let Some(mut started) = Started::with(&stored, unlocked) else { return };
    assert!(started.flagged());
    assert_eq!((started.info.configuration, started.info.writable), (Origin::Stored, false));
    assert_eq!(started.info.stored_fault, Some(StoreError::Flash(FlashFault::Unlocked)));
    let board = &mut started.board;
    let records = |board: &mut Board| board.read(At::Address(FLASH_BASE + STORE.start), STORE.len());
    let before = records(board);
    let refused = |result| match result {
        Err(DeviceError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    };
    let stores = on_bus(board).set_configuration(&Configuration::DEFAULT);
    assert_eq!(refused(stores), Refusal::Store(StoreError::NoFlash));
    assert!(records(board) == before);
    let events = board.events();
    let flash: Vec<_> = events.iter().filter(|event| event.kind.starts_with("flash")).collect();
    assert!(flash.is_empty(), "{flash:?}");
}
