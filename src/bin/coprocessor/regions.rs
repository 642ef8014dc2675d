//! The two regions of the flash that are written: records and weight slots.
#![allow(unsafe_code, reason = "memory by address; the block says why it is sound")]

use crate::pause;
use crate::stm32f405::flash::{Flash, FlashError, WORD};
use core::ops::Range;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use gyronet::service::MappedSlots;
use gyronet::store::layout::{RECORD_SECTOR, SLOT_SIZE, SLOTS, STORE};

/// An offset into a region as one into the flash.
fn absolute(region: &Range<u32>, offset: u32, len: usize, unit: usize) -> Result<u32, FlashError> {
    let start = region.start.checked_add(offset).ok_or(FlashError::OutOfBounds)?;
    let end = u32::try_from(len).ok().and_then(|len| start.checked_add(len));
    if end.is_none_or(|end| end > region.end) {
        return Err(FlashError::OutOfBounds);
    }
    let aligned = (start as usize).is_multiple_of(unit) && len.is_multiple_of(unit);
    if aligned { Ok(start) } else { Err(FlashError::NotAligned) }
}

macro_rules! region {
    ($name:ident, $range:expr, $sector:expr, $doc:literal) => {
        #[doc = $doc]
        pub struct $name(pub &'static Flash);

        impl ErrorType for $name {
            type Error = FlashError;
        }

        impl ReadNorFlash for $name {
            const READ_SIZE: usize = 1;

            fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
                self.0.read(absolute(&$range, offset, bytes.len(), 1)?, bytes);
                Ok(())
            }

            fn capacity(&self) -> usize {
                $range.len()
            }
        }

        impl NorFlash for $name {
            const WRITE_SIZE: usize = WORD;
            const ERASE_SIZE: usize = $sector;

            fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
                let len = to.checked_sub(from).ok_or(FlashError::OutOfBounds)? as usize;
                let start = absolute(&$range, from, len, $sector)?;
                let sectors = || (start..start + len as u32).step_by($sector);
                pause::announced(|| sectors().try_for_each(|sector| self.0.erase(sector)))
            }

            fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
                self.0.write(absolute(&$range, offset, bytes.len(), WORD)?, bytes)
            }
        }
    };
}

region!(Records, STORE, RECORD_SECTOR, "The sectors of records.");
region!(Slots, SLOTS, SLOT_SIZE, "The weight slots.");

impl MappedSlots for Slots {
    fn slots(&self) -> [&[u8]; 2] {
        slots_at_start()
    }
}

/// Gives both slots as they are. The one that the network runs on is not written while it does.
pub fn slots_at_start() -> [&'static [u8]; 2] {
    // SAFETY: inside the flash; see above.
    [SLOTS.start, SLOTS.start + SLOT_SIZE as u32].map(|offset| unsafe { Flash::mapped(offset, SLOT_SIZE) })
}
