//! Upload of a weight file, block by block, to a slot in the flash.

use super::error::FlashFault;
use super::slot::Slot;
use super::slots::{SlotError, file};
use crate::model::Blob;
use embedded_storage::nor_flash::{NorFlash, NorFlashError};

/// The state of an upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Upload {
    slot: Slot,
    length: u32,
    written: u32,
}

impl Upload {
    /// Checks the length of a file.
    ///
    /// # Errors
    /// [`SlotError::Length`].
    pub fn check(slot: Slot, length: u32) -> Result<(), SlotError> {
        let fits = length as usize <= slot.range().len() && length > 0 && length.is_multiple_of(4);
        if fits { Ok(()) } else { Err(SlotError::Length(length)) }
    }

    /// Begins an upload and erases its slot, which stalls the processor for one to two seconds on an F405 (its
    /// datasheet, 128 KiB sector). Offsets in `flash` are from the start of the whole flash.
    ///
    /// # Errors
    /// [`SlotError::Length`], [`SlotError::Flash`].
    pub fn begin<F: NorFlash>(flash: &mut F, slot: Slot, length: u32) -> Result<Self, SlotError> {
        Self::check(slot, length)?;
        let sector = slot.range();
        flash
            .erase(sector.start, sector.end)
            .map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        Ok(Self { slot, length, written: 0 })
    }

    /// Writes the next block, a whole number of words.
    ///
    /// # Errors
    /// [`SlotError::Offset`] if the block does not follow the previous one; [`SlotError::Length`] if it is not a
    /// whole number of words, or extends beyond the end of the file; [`SlotError::Flash`], after which
    /// the upload must begin again.
    pub fn block<F: NorFlash>(&mut self, flash: &mut F, offset: u32, bytes: &[u8]) -> Result<(), SlotError> {
        if offset != self.written {
            return Err(SlotError::Offset { expected: self.written });
        }
        let len = bytes.len() as u32;
        if !len.is_multiple_of(4) || len > self.length - self.written {
            return Err(SlotError::Length(len));
        }
        let at = self.slot.offset() + self.written;
        flash.write(at, bytes).map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        self.written += len;
        Ok(())
    }

    /// Checks the whole file in flash.
    ///
    /// # Errors
    /// [`SlotError::Incomplete`], and the errors of [`file()`].
    pub fn verify<'s>(&self, slots: [&'s [u8]; 2]) -> Result<Blob<'s>, SlotError> {
        if self.written != self.length {
            return Err(SlotError::Incomplete { written: self.written });
        }
        file(self.slot.of(slots))
    }

    /// Returns the slot of the file.
    pub const fn slot(&self) -> Slot {
        self.slot
    }

    /// Returns the number of bytes written.
    pub const fn written(&self) -> u32 {
        self.written
    }
}
