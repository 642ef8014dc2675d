//! Upload of a weight file or of firmware, block by block, to a slot in the flash.

use super::error::FlashFault;
use super::firmware;
use super::slot::Slot;
use super::slots::{SlotError, file};
use crate::model::Blob;
use embedded_storage::nor_flash::{NorFlash, NorFlashError};

/// The state of an upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Upload {
    slot: Slot,
    /// Flash offset of the first byte.
    start: u32,
    length: u32,
    written: u32,
}

impl Upload {
    /// Checks the length of a file.
    pub fn check(slot: Slot, length: u32) -> Result<(), SlotError> {
        let fits = length as usize <= slot.range().len() && length > 0 && length.is_multiple_of(4);
        if fits { Ok(()) } else { Err(SlotError::Length(length)) }
    }

    /// Begins an upload; the erase stalls the processor for one to two seconds. Offsets are from the flash's start.
    pub fn begin<F: NorFlash>(flash: &mut F, slot: Slot, length: u32) -> Result<Self, SlotError> {
        Self::check(slot, length)?;
        let sector = slot.range();
        flash
            .erase(sector.start, sector.end)
            .map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        Ok(Self { slot, start: sector.start, length, written: 0 })
    }

    /// Begins an upload of firmware, whose length has been checked, and erases its slot: two sectors.
    pub fn firmware<F: NorFlash>(flash: &mut F, slot: Slot, length: u32) -> Result<Self, SlotError> {
        firmware::erase(flash, slot).map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        Ok(Self { slot, start: slot.firmware().start, length, written: 0 })
    }

    /// Returns slot, length and number of bytes written of firmware; `None` for weights.
    pub const fn image(&self) -> Option<(Slot, u32, u32)> {
        if self.start == self.slot.firmware().start {
            Some((self.slot, self.length, self.written))
        } else {
            None
        }
    }

    /// Writes the next block, a whole number of words. After an error of the flash the upload must begin again.
    pub fn block<F: NorFlash>(&mut self, flash: &mut F, bytes: &[u8]) -> Result<(), SlotError> {
        let len = bytes.len() as u32;
        if !len.is_multiple_of(4) || len > self.missing() {
            return Err(SlotError::Length(len));
        }
        let at = self.start + self.written;
        flash.write(at, bytes).map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        self.written += len;
        Ok(())
    }

    /// Checks the whole weight file in flash, and returns its bytes too.
    pub fn verify<'s>(&self, slots: [&'s [u8]; 2]) -> Result<(&'s [u8], Blob<'s>), SlotError> {
        if self.written != self.length {
            return Err(SlotError::Incomplete { written: self.written });
        }
        let slot = self.slot.of(slots);
        Ok((slot.get(..self.length as usize).unwrap_or_default(), file(slot)?))
    }

    /// Returns the slot of the file.
    pub const fn slot(&self) -> Slot {
        self.slot
    }

    /// Returns the number of bytes that are missing.
    pub const fn missing(&self) -> u32 {
        self.length - self.written
    }

    /// Returns the number of bytes written.
    pub const fn written(&self) -> u32 {
        self.written
    }
}
