//! This module prepares the flash of an emulated board so that the board runs the largest possible model, the paper's
//! GyroNet, from a slot. Deadlines are measured with this model.

use crate::target::ram_flash::RamFlash;
use gyronet::model::weights::GYRONET;
use gyronet::service::MappedSlots;
use gyronet::store::layout::{FLASH_BASE, RECORD_SECTOR, SLOTS, STORE};
use gyronet::store::slots::SlotError;
use gyronet::store::{Accepted, Place, Slot, Store, StoreError, Upload};
use std::path::Path;

/// The reason why the flash could not be prepared.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The slot refuses the file.
    #[error(transparent)]
    Slot(#[from] SlotError),
    /// The store refuses the record.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A file for the emulator could not be written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Writes the records and the slots to files in a folder; returns the emulator's arguments that load the files.
///
/// # Errors
/// [`PrepareError`].
pub fn arguments(folder: &Path) -> Result<Vec<String>, PrepareError> {
    let mut weights = RamFlash::<RECORD_SECTOR>::for_weights();
    let mut upload = Upload::begin(&mut weights, Place::Slot(Slot::A), GYRONET.0.len() as u32)?;
    for (bytes, offset) in GYRONET.0.chunks(256).zip((0..).step_by(256)) {
        upload.block(&mut weights, offset, bytes)?;
    }
    let file = upload.verify(weights.slots(), weights.fognet())?;
    let mut records = RamFlash::<RECORD_SECTOR>::new(&[]);
    Store::open(&mut records, 0)?.set(&Accepted::NONE.with(upload.place(), file))?;
    let slots = weights.slots().concat();
    let mut arguments = Vec::new();
    for (start, bytes) in [(STORE.start, records.bytes()), (SLOTS.start, &slots)] {
        let path = folder.join(format!("largest_model_{start:x}.bin"));
        std::fs::write(&path, bytes)?;
        let address = FLASH_BASE + start;
        arguments.push("-device".to_owned());
        arguments.push(format!("loader,file={},addr={address:#x},force-raw=on", path.display()));
    }
    Ok(arguments)
}
