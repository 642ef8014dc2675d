//! The records, in the flash bank that is not executed from: the core and the frames go on while it is erased and written.
//!
//! This flash programs quad-words of 16 bytes, each once, since it keeps a code of each. The library's store writes words and
//! later overwrites some with zeros. So a word takes two quad-words: its value, and a mark that it is zero by now. A power cut
//! leaves a quad-word whose code does not fit; reading it is an NMI, and its word reads as zero, which no record's checksum fits.

use crate::service::alive;
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};
use cortex_m::peripheral::SCB;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::pac::{self, flash::vals::OptsrSwapBank};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use gyronet::service::MappedSlots;

/// Offset of the second bank, which the records begin.
const BANK_2: u32 = 0x10_0000;
/// Size of a sector of the flash, bytes.
const SECTOR: u32 = 8 << 10;
const QUAD: usize = 16;
const WORD: usize = 4;
/// Bytes of flash for each byte of the records.
const SPREAD: u32 = (2 * QUAD / WORD) as u32;
/// Bytes that a check of erased flash reads at once.
const PIECE: usize = 256;
/// Every flag of NSCCR.
const FLAGS: u32 = 0x00FF_0000;

/// True once flash was read whose code does not fit.
static IS_TORN: AtomicBool = AtomicBool::new(false);

/// Notes flash whose code does not fit; no other NMI is expected.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if !pac::FLASH.eccdetr().read().eccd() {
        SCB::sys_reset();
    }
    pac::FLASH.eccdetr().modify(|w| w.set_eccd(true));
    IS_TORN.store(true, Relaxed);
}

pub struct Records(Flash<'static, Blocking>);

impl Records {
    /// Returns no records if an option has swapped the banks: erases go by the bank itself, where the program lies then.
    pub fn new(flash: Flash<'static, Blocking>) -> Option<Self> {
        (pac::FLASH.optsr_cur().read().swap_bank() == OptsrSwapBank::B_0X0).then_some(Self(flash))
    }

    /// Reads flash; `None` if its code does not fit.
    fn read_flash<const N: usize>(&mut self, at: u32) -> Result<Option<[u8; N]>, NorFlashErrorKind> {
        let mut bytes = [0; N];
        IS_TORN.store(false, Relaxed);
        self.0.blocking_read(at, &mut bytes).map_err(|error| error.kind())?;
        cortex_m::asm::dsb();
        Ok(Some(bytes).filter(|_| !IS_TORN.load(Relaxed)))
    }

    /// Returns the word at an offset into the records.
    fn word(&mut self, offset: u32) -> Result<[u8; WORD], NorFlashErrorKind> {
        let place = BANK_2 + offset * SPREAD;
        let value = self.read_flash(place)?;
        let mark = self.read_flash(place + QUAD as u32)?;
        Ok(value.filter(|_| mark == Some([0xFF; QUAD])).unwrap_or([0; WORD]))
    }

    fn is_erased(&mut self, sector: u32) -> Result<bool, NorFlashErrorKind> {
        for at in (sector..sector + SECTOR).step_by(PIECE) {
            if self.read_flash(at)? != Some([0xFF; PIECE]) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Clears the flags of earlier operations, which embassy's driver writes to a read-only register.
    fn clear() {
        pac::FLASH.nsccr().write(|w| w.0 = FLAGS);
    }

    /// Returns the range, if it lies in the records and both ends are multiples of a unit.
    fn checked(from: u32, to: u32, unit: usize) -> Result<(), NorFlashErrorKind> {
        let is_multiple = |at: u32| (at as usize).is_multiple_of(unit);
        match (from <= to && to as usize <= 2 * Self::ERASE_SIZE, is_multiple(from) && is_multiple(to)) {
            (true, true) => Ok(()),
            (false, _) => Err(NorFlashErrorKind::OutOfBounds),
            (_, false) => Err(NorFlashErrorKind::NotAligned),
        }
    }
}

impl ErrorType for Records {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Records {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        Self::checked(offset, offset.saturating_add(bytes.len() as u32), WORD)?;
        for (at, word) in (offset..).step_by(WORD).zip(bytes.as_chunks_mut().0) {
            *word = self.word(at)?;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * Self::ERASE_SIZE
    }
}

impl NorFlash for Records {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = 8 << 10;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        Self::checked(from, to, Self::ERASE_SIZE)?;
        for sector in (BANK_2 + from * SPREAD..BANK_2 + to * SPREAD).step_by(SECTOR as usize) {
            if !self.is_erased(sector)? {
                Self::clear();
                self.0.blocking_erase(sector, sector + SECTOR).map_err(|error| error.kind())?;
                if !self.is_erased(sector)? {
                    return Err(NorFlashErrorKind::Other);
                }
            }
            alive();
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        Self::checked(offset, offset.saturating_add(bytes.len() as u32), WORD)?;
        for (at, word) in (offset..).step_by(WORD).zip(bytes.as_chunks::<WORD>().0) {
            let old = self.word(at)?;
            let mut quad = [0xFF; QUAD];
            let place = match (old, *word) {
                (old, word) if old == word => continue,
                ([0xFF, 0xFF, 0xFF, 0xFF], [a, b, c, d]) => {
                    let [first, second, third, fourth, ..] = &mut quad;
                    (*first, *second, *third, *fourth) = (a, b, c, d);
                    0
                }
                (_, [0, 0, 0, 0]) => {
                    quad = [0; QUAD];
                    QUAD as u32
                }
                _ => return Err(NorFlashErrorKind::Other),
            };
            Self::clear();
            self.0.blocking_write(BANK_2 + at * SPREAD + place, &quad).map_err(|error| error.kind())?;
            if self.word(at)? != *word {
                return Err(NorFlashErrorKind::Other);
            }
        }
        Ok(())
    }
}

/// Slots for weights and firmware, which this board does not have yet.
pub enum NoSlots {}

impl ErrorType for NoSlots {
    type Error = Infallible;
}

impl ReadNorFlash for NoSlots {
    const READ_SIZE: usize = 1;

    fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), Infallible> {
        match *self {}
    }

    fn capacity(&self) -> usize {
        match *self {}
    }
}

impl NorFlash for NoSlots {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 1;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), Infallible> {
        match *self {}
    }

    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), Infallible> {
        match *self {}
    }
}

impl MappedSlots for NoSlots {
    fn slots(&self) -> [&[u8]; 2] {
        match *self {}
    }
}
