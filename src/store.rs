//! The store keeps the configuration, the calibration and two slots for weight files through a power cut.
//!
//! | what | where | written as | after an interrupted write |
//! |---|---|---|---|
//! | [`Configuration`], [`WheelSettings`](crate::can::wheel::WheelSettings), [`Calibration`], [`Learned`], [`Troubles`], which slot is used | two 16 KiB sectors, a [`Store`] | a new record behind the old one | the old record |
//! | weight files | two 128 KiB sectors, [`slots`] | the slot that is not in use | the slot in use |
//! | firmware | two slots of 256 KiB, [`firmware`] | the slot that does not run | the image that runs |
//!
//! New data never overwrites the data in use, so an interrupted write leaves the old record or slot intact. Records
//! are found by key and protected by CRC-32; each carries the version of its layout, and every value is checked
//! against its range when it is stored and when it is read. A weight file is used only after all checks of
//! [`crate::model::Blob::new_checked`]. [`layout`] defines the addresses in flash.

pub mod access;
#[doc(hidden)]
pub mod banks;
pub mod calibration;
pub mod configuration;
mod error;
#[doc(hidden)]
pub mod firmware;
#[doc(hidden)]
pub mod layout;
mod learned;
pub(crate) mod record;
mod slot;
#[doc(hidden)]
pub mod slots;
mod troubles;
mod upload;

pub use access::Access;
pub use calibration::{Calibration, UnitMap};
pub use configuration::{Configuration, FogGyro, FogPart, ImuPart, Mounting};
pub use error::{Field, FieldError, FlashFault, StoreError};
pub use learned::Learned;
pub use record::{Record, Store};
pub use slot::Slot;
pub use slots::Accepted;
pub use troubles::{MAX_TROUBLES, Snapshot, StoredTrouble, Troubles};
pub use upload::Upload;
