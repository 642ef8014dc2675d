//! A board's answers are printed as sentences, with the cause in them.

use gyronet::service::event::SensorFault;
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
    let setting = SensorFault::Setting { bank: 1, address: 0x0A, got: 0xFF };
    assert_eq!(setting.to_string(), "register 0x0a of bank 1 holds 0xff, not what was written");
}
