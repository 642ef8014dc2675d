//! A board's answers are printed as sentences, with the cause in them.

use gyronet::health::Status;
use gyronet::service::crash::FILE;
use gyronet::service::event::{Crash, CrashKind, EventKind, ResetCause, SensorFault};
use gyronet::service::message::{FlashState, Origin};
use gyronet::store::Slot;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{FieldError, FlashFault, StoreError};

#[test]
fn states_are_sentences() {
    let part = StoreError::Field(FieldError::PartNotInImage);
    assert_eq!(
        Origin::Refused(part).to_string(),
        "built in; the stored one is refused: sensor: this firmware image does not drive the part"
    );
    assert_eq!(
        FlashState::Failed(StoreError::Full).to_string(),
        "cannot be read: no room is left for the record"
    );
    assert_eq!(WeightSource::Slot(Slot::B).to_string(), "slot B");
    for (fault, part) in [
        (FlashFault::NotAligned, "start of a word"),
        (FlashFault::OutOfBounds, "beyond its end"),
        (FlashFault::Refused, "did not take"),
    ] {
        assert!(SlotError::Flash(fault).to_string().contains(part), "{fault}");
    }
}

#[test]
fn events_are_sentences() {
    let crash = Crash {
        kind: CrashKind::HardFault,
        place: 0x0800_1234,
        link: 0x0800_5679,
        status: 0x8200,
        address: 0x1FFF_FFF8,
        file: [0; FILE],
        count: 2,
    };
    let panic = Crash { kind: CrashKind::Panic, place: 12, file: *b"coprocessor/src/main.rs\0", ..crash };
    for (kind, due) in [
        (EventKind::Started(ResetCause::PowerOn), "started by power on"),
        (
            EventKind::Crashed(crash),
            "crashed before: hard fault at 0x08001234, called from 0x08005679, CFSR 0x00008200, address 0x1ffffff8, 2 since power-on",
        ),
        (
            EventKind::Crashed(panic),
            "crashed before: panic in line 12 of coprocessor/src/main.rs, 2 since power-on",
        ),
        (EventKind::SlotRefused(Slot::A, SlotError::Empty), "slot A not used: the slot is empty"),
        (EventKind::Status(Status::Init), "status: initialising, no bias yet"),
        (
            EventKind::Sensor(Some(SensorFault::Setting { bank: 1, address: 0x0A, got: 0xFF })),
            "sensor not set up: register 0x0a of bank 1 holds 0xff, not what was written",
        ),
    ] {
        assert_eq!(kind.to_string(), due);
    }
}
