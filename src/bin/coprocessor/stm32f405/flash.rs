//! The flash (RM0090 3). Reading it wants no controller; the emulator has none, and writes nothing.
#![allow(unsafe_code, reason = "flash is memory that is written by address; each block says why it is sound")]

use crate::regions::{FlashError, WORD};
use core::cell::RefCell;
use embedded_storage::nor_flash::NorFlashErrorKind;
use gyronet::store::layout::{FLASH_BASE, SLOT_SIZE, SLOTS, sector_at};
use stm32f4::stm32f405 as pac;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// Polls before an operation is given up. Code runs from the same flash and stands still while
/// it is busy, so this many are never needed.
const POLLS: u32 = 10_000_000;

/// The controller, locked but while it works.
pub struct Flash {
    registers: RefCell<pac::FLASH>,
}

impl Flash {
    /// The part's own, which can always be read.
    pub fn probe() -> Option<Self> {
        // SAFETY: the clock tree is done with it, and this is called once.
        Some(Self { registers: RefCell::new(unsafe { pac::FLASH::steal() }) })
    }

    /// Whether the controller answers: it is locked but while it works, and the emulator's nothing
    /// reads as not locked.
    pub fn writable(&self) -> bool {
        self.registers.try_borrow().is_ok_and(|registers| locked(&registers))
    }

    fn operate(
        &self,
        operation: impl FnOnce(&pac::FLASH) -> Result<(), FlashError>,
    ) -> Result<(), FlashError> {
        let refused = FlashError(NorFlashErrorKind::Other);
        let registers = self.registers.try_borrow_mut().map_err(|_| refused)?;
        if !locked(&registers) {
            return Err(refused);
        }
        for key in KEYS {
            registers.keyr().write(|w| unsafe {
                // SAFETY: the two keys that unlock it, in order.
                w.bits(key)
            });
        }
        let result = idle(&registers).and_then(|()| operation(&registers)).and_then(|()| idle(&registers));
        registers.cr().write(|w| w.lock().set_bit());
        flush_cache(&registers);
        result
    }

    /// From an offset on; inside the regions that there are.
    pub fn read(&self, offset: u32, bytes: &mut [u8]) {
        for (at, byte) in (FLASH_BASE + offset..).zip(bytes) {
            // SAFETY: inside a region, which is always there and readable.
            *byte = unsafe { (at as *const u8).read_volatile() };
        }
    }

    /// The sector that begins there.
    pub fn erase(&self, offset: u32) -> Result<(), FlashError> {
        let sector = sector_at(offset).ok_or(FlashError(NorFlashErrorKind::NotAligned))?;
        self.operate(|registers| {
            // SAFETY: a number from the part's own table, and words of 32 bits.
            registers.cr().write(|w| unsafe { w.ser().set_bit().snb().bits(sector).psize().bits(2) });
            registers.cr().modify(|_, w| w.strt().set_bit());
            Ok(())
        })
    }

    /// Whole words, into an erased place.
    pub fn write(&self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.operate(|registers| {
            // SAFETY: words of 32 bits.
            registers.cr().write(|w| unsafe { w.pg().set_bit().psize().bits(2) });
            for (at, word) in (FLASH_BASE + offset..).step_by(WORD).zip(bytes.as_chunks::<WORD>().0) {
                // SAFETY: inside the records or the weight slots, as `regions` checks; on
                // a word boundary. No reference to these bytes is alive: records are only copied
                // out, and a slot in use is not written.
                unsafe { (at as *mut u32).write_volatile(u32::from_le_bytes(*word)) };
                idle(registers)?;
            }
            Ok(())
        })
    }

    /// Both slots as they are when the image starts; the one that the network then runs on is
    /// not written while it does.
    pub fn slots_at_start(&self) -> [&'static [u8]; 2] {
        [SLOTS.start, SLOTS.start + SLOT_SIZE as u32].map(|offset| {
            // SAFETY: memory that is always there and readable.
            unsafe { core::slice::from_raw_parts((FLASH_BASE + offset) as *const u8, SLOT_SIZE) }
        })
    }
}

fn locked(registers: &pac::FLASH) -> bool {
    registers.cr().read().lock().bit_is_set()
}

/// Waits until the controller is idle, and reports what went wrong.
fn idle(registers: &pac::FLASH) -> Result<(), FlashError> {
    let refused = Err(FlashError(NorFlashErrorKind::Other));
    if !(0..POLLS).any(|_| registers.sr().read().bsy().bit_is_clear()) {
        return refused;
    }
    let status = registers.sr().read();
    let failed = status.pgserr().bit_is_set()
        || status.pgperr().bit_is_set()
        || status.pgaerr().bit_is_set()
        || status.wrperr().bit_is_set();
    // SAFETY: these flags are cleared by writing ones (RM0090 3.9.4).
    registers.sr().write(|w| unsafe { w.bits(0xF2) });
    if failed { refused } else { Ok(()) }
}

/// What the data cache still holds of flash that has changed (RM0090 3.5.4).
fn flush_cache(registers: &pac::FLASH) {
    if registers.acr().read().dcen().bit_is_set() {
        registers.acr().modify(|_, w| w.dcen().clear_bit());
        registers.acr().modify(|_, w| w.dcrst().set_bit());
        registers.acr().modify(|_, w| w.dcrst().clear_bit().dcen().set_bit());
    }
}
