//! The regions of the flash that the image writes: records, weight files, and firmware in the slot that does not run.
#![allow(unsafe_code, reason = "memory by address; the block says why it is sound")]

use crate::stm32f405::flash::{Flash, FlashError, WORD};
use crate::stm32f405::watchdog;
use crate::tasks;
use core::ops::Range;
use cortex_m::peripheral::SCB;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use gyronet::service::MappedSlots;
use gyronet::store::Slot;
use gyronet::store::layout::{
    FIRMWARE_A, FIRMWARE_B, FLASH_BASE, RECORD_SECTOR, SLOT_SIZE, SLOTS, STORE, sector,
};

/// Returns the range, if both of its ends are multiples of a unit.
fn aligned(range: Range<u32>, unit: usize) -> Result<Range<u32>, FlashError> {
    let fits = (range.start as usize).is_multiple_of(unit) && range.len().is_multiple_of(unit);
    if fits { Ok(range) } else { Err(FlashError::NotAligned) }
}

/// Erases a range of whole sectors, after announcing the silence on the buses.
fn erase(flash: &Flash, range: Range<u32>) -> Result<(), FlashError> {
    let runs = |slot: Slot| slot.firmware().contains(&range.start);
    if running().is_some_and(runs) {
        return Err(FlashError::OutOfBounds);
    }
    tasks::with_silence_announced(|| {
        let mut at = range.start;
        while at < range.end {
            let sector = sector(at).filter(|sector| sector.end <= range.end).ok_or(FlashError::NotAligned)?;
            flash.erase(sector.start)?;
            at = sector.end;
        }
        Ok(())
    })
}

/// Ranges of the flash, whose sectors are at least `ERASE` bytes; offsets count from `base`.
pub struct Region<const ERASE: usize> {
    flash: &'static Flash,
    base: u32,
    ranges: &'static [Range<u32>],
}

/// The sectors of the records.
pub type Records = Region<RECORD_SECTOR>;
/// The slots for weights and firmware, by offset into the flash.
pub type Weights = Region<SLOT_SIZE>;

impl Records {
    pub const fn records(flash: &'static Flash) -> Self {
        Self { flash, base: STORE.start, ranges: &[STORE] }
    }
}

impl Weights {
    pub const fn weights(flash: &'static Flash) -> Self {
        Self { flash, base: 0, ranges: &[SLOTS, FIRMWARE_A, FIRMWARE_B] }
    }
}

impl<const ERASE: usize> Region<ERASE> {
    /// Returns the range of `len` bytes from an offset, if it lies in one of the region's.
    fn inside(&self, offset: u32, len: usize) -> Result<Range<u32>, FlashError> {
        let start = offset.checked_add(self.base);
        let range = start.and_then(|start| Some(start..start.checked_add(u32::try_from(len).ok()?)?));
        let range = range.ok_or(FlashError::OutOfBounds)?;
        let holds = |region: &Range<u32>| region.start <= range.start && range.end <= region.end;
        if self.ranges.iter().any(holds) { Ok(range) } else { Err(FlashError::OutOfBounds) }
    }
}

impl<const ERASE: usize> ErrorType for Region<ERASE> {
    type Error = FlashError;
}

impl<const ERASE: usize> ReadNorFlash for Region<ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.flash.read(self.inside(offset, bytes.len())?.start, bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.ranges.iter().map(|range| (range.end - self.base) as usize).max().unwrap_or(0)
    }
}

impl<const ERASE: usize> NorFlash for Region<ERASE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let len = to.checked_sub(from).ok_or(FlashError::OutOfBounds)? as usize;
        erase(self.flash, self.inside(from, len)?)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let range = aligned(self.inside(offset, bytes.len())?, WORD)?;
        self.flash.write(range.start, bytes)
    }
}

impl MappedSlots for Weights {
    fn slots(&self) -> [&[u8]; 2] {
        slots_at_start()
    }

    fn running(&self) -> Option<Slot> {
        running()
    }

    fn firmware(&self, slot: Slot) -> &[u8] {
        let range = slot.firmware();
        // SAFETY: inside the flash; it is written only while no slice of it is used.
        unsafe { Flash::mapped(range.start, range.len()) }
    }

    fn check<T>(&self, work: impl FnOnce() -> T) -> T {
        watchdog::with_long_limit(work)
    }
}

/// Returns the slot that the boot loader has started.
fn running() -> Option<Slot> {
    // SAFETY: the register is only read.
    let vectors = unsafe { &*SCB::PTR }.vtor.read();
    Slot::ALL.into_iter().find(|slot| vectors == FLASH_BASE + slot.firmware().start)
}

/// Returns both slots. The slot that the network runs on is not written meanwhile.
pub fn slots_at_start() -> [&'static [u8]; 2] {
    // SAFETY: inside the flash; see above.
    [SLOTS.start, SLOTS.start + SLOT_SIZE as u32].map(|offset| unsafe { Flash::mapped(offset, SLOT_SIZE) })
}
