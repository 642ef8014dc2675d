//! An upload writes a weight file block by block to its place in the flash, and erases each sector before the first
//! block in it.

use super::error::FlashFault;
use super::layout::sector;
use super::place::Place;
use super::slots::{SlotError, bytes, file};
use crate::model::FogBlob;
use embedded_storage::nor_flash::{NorFlash, NorFlashError};

/// The state of an upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Upload {
    place: Place,
    length: u32,
    written: u32,
}

impl Upload {
    /// Checks the length of a file.
    ///
    /// # Errors
    /// [`SlotError::Length`].
    pub fn check(place: Place, length: u32) -> Result<(), SlotError> {
        let fits = length as usize <= place.range().len() && length > 0 && length.is_multiple_of(4);
        if fits { Ok(()) } else { Err(SlotError::Length(length)) }
    }

    /// Begins an upload and erases the first sector of its place; each further sector is erased by the block that
    /// begins it. An erase stalls the processor for one to two seconds on an F405 (its datasheet, 128 KiB sector).
    /// Offsets in `flash` are from the start of the whole flash.
    ///
    /// # Errors
    /// [`SlotError::Length`], [`SlotError::Flash`].
    pub fn begin<F: NorFlash>(flash: &mut F, place: Place, length: u32) -> Result<Self, SlotError> {
        Self::check(place, length)?;
        let upload = Self { place, length, written: 0 };
        upload.erase_sector(flash)?;
        Ok(upload)
    }

    /// Writes the next block, a whole number of words.
    ///
    /// # Errors
    /// [`SlotError::Offset`] if the block does not follow the previous one; [`SlotError::Length`] if it is not a
    /// whole number of words, or extends beyond the end of the file or of a sector; [`SlotError::Flash`], after which
    /// the upload must begin again.
    pub fn block<F: NorFlash>(&mut self, flash: &mut F, offset: u32, bytes: &[u8]) -> Result<(), SlotError> {
        if offset != self.written {
            return Err(SlotError::Offset { expected: self.written });
        }
        let len = bytes.len() as u32;
        let at = self.place.range().start + self.written;
        let crosses = (1..len).any(|further| sector(at + further).is_some());
        if !len.is_multiple_of(4) || len > self.length - self.written || crosses {
            return Err(SlotError::Length(len));
        }
        if self.written > 0 {
            self.erase_sector(flash)?;
        }
        flash.write(at, bytes).map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        self.written += len;
        Ok(())
    }

    /// Erases the sector that begins at the offset of the next block, if one does.
    fn erase_sector<F: NorFlash>(&self, flash: &mut F) -> Result<(), SlotError> {
        let Some(sector) = sector(self.place.range().start + self.written) else { return Ok(()) };
        flash
            .erase(sector.start, sector.end)
            .map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))
    }

    /// Checks the whole file in flash and returns its checksum.
    ///
    /// # Errors
    /// [`SlotError::Incomplete`], and the errors of [`file()`].
    pub fn verify(&self, slots: [&[u8]; 2], fognet: &[u8]) -> Result<u32, SlotError> {
        if self.written != self.length {
            return Err(SlotError::Incomplete { written: self.written });
        }
        match self.place {
            Place::Slot(slot) => file(slot.of(slots)).map(|blob| blob.crc),
            Place::FogNet => Ok(FogBlob::new_checked(bytes(fognet)?)?.crc),
        }
    }

    /// Returns the place of the file.
    #[must_use]
    pub const fn place(&self) -> Place {
        self.place
    }

    /// Returns the number of bytes written.
    #[must_use]
    pub const fn written(&self) -> u32 {
        self.written
    }
}
