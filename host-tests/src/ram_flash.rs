//! Simulates a flash in RAM. It is fast enough for fuzzing and does not check the rules of a real flash.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use gyronet::service::MappedSlots;
use gyronet::store::Slot;
use gyronet::store::firmware::{LABEL, LABEL_SIZE, Label, MAX_IMAGE, TRAILER, Trailer};
use gyronet::store::layout::{SLOT_SIZE, SLOTS};
use std::ops::Range;

/// What the firmware of a flash is.
pub const FIRMWARE: Label = Label::new([1, 0, 0], "a board");

/// Simulates a flash; its smallest sectors are `SECTOR` bytes long.
#[derive(Debug, Clone)]
pub struct RamFlash<const SECTOR: usize> {
    words: Vec<u32>,
    /// Slot of the firmware that runs.
    running: Option<Slot>,
}

impl<const SECTOR: usize> RamFlash<SECTOR> {
    /// Creates a flash with firmware in slot A, which runs.
    pub fn for_weights() -> Self {
        let mut flash = Self { words: vec![u32::MAX; SLOTS.end as usize / 4], running: Some(Slot::A) };
        let start = Slot::A.firmware().start as usize;
        let trailer = Trailer { is_confirmed: true, ..Trailer::new(4, 0, 0, 1) };
        flash.bytes_mut()[start + LABEL..][..LABEL_SIZE].copy_from_slice(&FIRMWARE.bytes());
        flash.bytes_mut()[start + MAX_IMAGE as usize..][..TRAILER].copy_from_slice(&trailer.bytes());
        flash
    }

    /// Creates a flash of two sectors that begins with these bytes and is erased after them.
    pub fn new(content: &[u8]) -> Self {
        let mut flash = Self { words: vec![u32::MAX; 2 * SECTOR / 4], running: None };
        let len = content.len().min(2 * SECTOR);
        flash.bytes_mut()[..len].copy_from_slice(&content[..len]);
        flash
    }

    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.words)
    }

    fn range(&mut self, from: u32, len: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        let from = from as usize;
        self.bytes_mut().get_mut(from..from + len).ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl<const SECTOR: usize> ErrorType for RamFlash<SECTOR> {
    type Error = NorFlashErrorKind;
}

impl<const SECTOR: usize> ReadNorFlash for RamFlash<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        bytes.copy_from_slice(self.range(offset, bytes.len())?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        4 * self.words.len()
    }
}

impl<const SECTOR: usize> NorFlash for RamFlash<SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        if !(from as usize).is_multiple_of(SECTOR) || !((to - from) as usize).is_multiple_of(SECTOR) {
            return Err(NorFlashErrorKind::NotAligned);
        }
        self.range(from, (to - from) as usize)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        if !offset.is_multiple_of(4) || !bytes.len().is_multiple_of(4) {
            return Err(NorFlashErrorKind::NotAligned);
        }
        // Programming only clears bits.
        for (to, from) in self.range(offset, bytes.len())?.iter_mut().zip(bytes) {
            *to &= from;
        }
        Ok(())
    }
}

impl<const SECTOR: usize> MappedSlots for RamFlash<SECTOR> {
    fn slots(&self) -> [&[u8]; 2] {
        self.bytes()[SLOTS.start as usize..SLOTS.end as usize].split_at(SLOT_SIZE).into()
    }

    fn running(&self) -> Option<Slot> {
        self.running
    }

    fn firmware(&self, slot: Slot) -> &[u8] {
        let Range { start, end } = slot.firmware();
        &self.bytes()[start as usize..end as usize]
    }
}
