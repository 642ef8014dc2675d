//! The flash controller (RM0090 3): erases sectors and programs words.
//!
//! Code runs from the same flash, so the processor stalls while an operation runs: 16 us a word, up to 2 s a sector
//! of 128 KiB (DS8626 table 48). The watchdog gets its long limit for an erase.
//!
//! A locked controller ignores operations without an error. Each operation is therefore checked by its effect: an
//! erased sector reads as ones, a programmed word as written.
#![allow(unsafe_code, reason = "flash is memory that is written by address; each block says why it is sound")]

use super::{pac, supply, wait_until, watchdog};
use core::cell::RefCell;
use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};
use gyronet::store::FlashFault;
use gyronet::store::layout::{FLASH_BASE, SECTORS, sector_at};

pub const WORD: usize = 4;
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
const ERASED: u32 = u32::MAX;
/// Polls before an operation times out. The processor stalls while the controller is busy, so one poll is nearly
/// always enough.
const POLLS: u32 = 10_000_000;
/// OPERR, WRPERR, PGAERR, PGPERR, PGSERR and EOP, which are cleared by ones (RM0090 3.9.4).
const FLAGS: u32 = 0xF3;
const ERRORS: u32 = 0xF2;

/// The reason why the flash was not changed, or not as requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashError {
    /// The range is outside the region.
    OutOfBounds,
    /// The range does not begin and end at the boundary of a sector or a word.
    NotAligned,
    Busy,
    /// The controller did not accept its keys; it refuses them until the next reset.
    Locked,
    /// The supply is below 2.9 V: below 2.7 V programming is not reliable.
    SupplyLow,
    /// The controller reports an error: the flags of FLASH_SR.
    Refused(u8),
    /// The sector, or the word at this offset, does not read back as expected.
    NotVerified(u32),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// The flash controller, which is locked except during an operation.
pub struct Flash(RefCell<pac::FLASH>);

impl Flash {
    /// Takes ownership of the controller, which the clock tree no longer uses.
    pub const fn new(registers: pac::FLASH) -> Self {
        Self(RefCell::new(registers))
    }

    /// Checks that the controller is locked, as every reset and every operation leaves it. One that is not may be
    /// writing what other code has begun, or its registers do not work.
    pub fn check(&self) -> Result<(), FlashFault> {
        if self.0.try_borrow().is_ok_and(|registers| locked(&registers)) {
            Ok(())
        } else {
            Err(FlashFault::Unlocked)
        }
    }

    /// Reads bytes from an offset on; the caller has checked that they are inside the flash.
    pub fn read(&self, offset: u32, bytes: &mut [u8]) {
        for (at, byte) in (FLASH_BASE + offset..).zip(bytes) {
            // SAFETY: inside the flash, which is always mapped and readable.
            *byte = unsafe { (at as *const u8).read_volatile() };
        }
    }

    /// Returns `len` bytes from an offset on, in place.
    ///
    /// # Safety
    /// They are inside the flash, and nothing writes them while the slice is used.
    pub unsafe fn mapped(offset: u32, len: usize) -> &'static [u8] {
        // SAFETY: see above.
        unsafe { core::slice::from_raw_parts((FLASH_BASE + offset) as *const u8, len) }
    }

    pub fn erase(&self, offset: u32) -> Result<(), FlashError> {
        let sector = sector_at(offset).ok_or(FlashError::NotAligned)?;
        let len = SECTORS.get(usize::from(sector)).copied().unwrap_or_default();
        watchdog::with_long_limit(|| {
            self.operate(|registers| {
                // SAFETY: the number of a sector, and PSIZE = 10 for 32 bits (2.7 to 3.6 V, RM0090 table 7).
                registers.cr().modify(|_, w| unsafe { w.ser().set_bit().snb().bits(sector).psize().bits(2) });
                if registers.cr().read().ser().bit_is_clear() {
                    return Err(FlashError::Locked);
                }
                registers.cr().modify(|_, w| w.strt().set_bit());
                idle(registers)
            })
        })?;
        let blank = (offset..offset + len).step_by(WORD).all(|at| word(at) == ERASED);
        if blank { Ok(()) } else { Err(FlashError::NotVerified(offset)) }
    }

    /// Programs whole words from an offset on, into erased flash.
    pub fn write(&self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.operate(|registers| {
            // SAFETY: PSIZE = 10 for 32 bits.
            registers.cr().modify(|_, w| unsafe { w.pg().set_bit().psize().bits(2) });
            for (at, bytes) in (offset..).step_by(WORD).zip(bytes.as_chunks::<WORD>().0) {
                if supply::is_low() {
                    return Err(FlashError::SupplyLow);
                }
                let value = u32::from_le_bytes(*bytes);
                // SAFETY: inside the records, the weight slots or the spare sector, as the caller checks; on
                // a word boundary. No reference to these bytes is alive: records are copied out, and a
                // slot that is in use is not written.
                unsafe { ((FLASH_BASE + at) as *mut u32).write_volatile(value) };
                idle(registers)?;
            }
            Ok(())
        })?;
        let mut words = (offset..).step_by(WORD).zip(bytes.as_chunks::<WORD>().0);
        match words.find(|(at, bytes)| word(*at) != u32::from_le_bytes(**bytes)) {
            Some((at, _)) => Err(FlashError::NotVerified(at)),
            None => Ok(()),
        }
    }

    fn operate(
        &self,
        operation: impl FnOnce(&pac::FLASH) -> Result<(), FlashError>,
    ) -> Result<(), FlashError> {
        let registers = self.0.try_borrow_mut().map_err(|_| FlashError::Busy)?;
        if supply::is_low() {
            return Err(FlashError::SupplyLow);
        }
        // Clear the flags of an earlier operation, which would be taken for errors of this one.
        // SAFETY: ones clear their flags.
        registers.sr().write(|w| unsafe { w.bits(FLAGS) });
        if locked(&registers) {
            for key in KEYS {
                // SAFETY: the two keys, in order (RM0090 3.9.2).
                registers.keyr().write(|w| unsafe { w.bits(key) });
            }
        }
        let result = if locked(&registers) { Err(FlashError::Locked) } else { operation(&registers) };
        // SAFETY: LOCK alone (RM0090 3.9.5); SER, PG and the sector's number go back to zero.
        // reset value: 0x8000_0000, the same bit
        registers.cr().write(|w| unsafe { w.bits(1 << 31) });
        flush_caches(&registers);
        result
    }
}

fn word(offset: u32) -> u32 {
    // SAFETY: inside the flash, on a word boundary.
    unsafe { ((FLASH_BASE + offset) as *const u32).read_volatile() }
}

fn locked(registers: &pac::FLASH) -> bool {
    registers.cr().read().lock().bit_is_set()
}

/// Waits until the controller is idle and returns the error that it reports.
fn idle(registers: &pac::FLASH) -> Result<(), FlashError> {
    if !wait_until(POLLS, || registers.sr().read().bsy().bit_is_clear()) {
        return Err(FlashError::Busy);
    }
    let errors = registers.sr().read().bits() & ERRORS;
    if errors == 0 { Ok(()) } else { Err(FlashError::Refused(errors as u8)) }
}

/// Flushes the caches after flash has changed (RM0090 3.5.4): a cache is reset while it is off.
fn flush_caches(registers: &pac::FLASH) {
    let acr = registers.acr();
    if acr.read().dcen().bit_is_set() {
        acr.modify(|_, w| w.dcen().clear_bit().icen().clear_bit());
        acr.modify(|_, w| w.dcrst().set_bit().icrst().set_bit());
        acr.modify(|_, w| w.dcrst().clear_bit().icrst().clear_bit());
        acr.modify(|_, w| w.dcen().set_bit().icen().set_bit());
    }
}
