//! Boot loader: starts the newest image that is whole and confirmed, or on trial ([`gyronet::store::firmware`]).
//!
//! It runs on the internal oscillator at 16 MHz and changes no clock. The watchdog runs from here on, so an image that
//! hangs before its own start is reset too. If no image is whole, the LED flashes twice a second and the watchdog has the
//! board try again; a probe can flash it over SWD as ever.
#![no_std]
#![no_main]
#![allow(
    unsafe_code,
    reason = "the start of an image, and flash that is read in place; each block says why it is sound"
)]

#[path = "../boards/mod.rs"]
#[allow(dead_code, reason = "only the LED is used")]
mod boards;
#[path = "../stm32f405/mod.rs"]
#[allow(dead_code, reason = "the drivers are the coprocessor's, which uses all of them")]
mod stm32f405;

use crate::boards::BOARD;
use crate::stm32f405::flash::{Flash, FlashError, WORD};
use crate::stm32f405::{enable_peripherals, pac, supply, watchdog};
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use gyronet::store::Slot;
use gyronet::store::firmware::{TRAILER, select};
use gyronet::store::layout::{FLASH_BASE, SECTORS};

/// An eighth of a second at 16 MHz, of which a step of the delay takes two clocks, and the eighths in which the LED is
/// lit.
const EIGHTH: u32 = 1_000_000;
const PATTERN: u32 = 0b0101;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(p) = pac::Peripherals::take() else { SCB::sys_reset() };
    watchdog::start(&p.DBGMCU);
    // The image reads the flags of the reset and clears them.
    let flags = p.RCC.csr().read();
    // The image resets itself, too, when the supply falls and when the crystal has started: no fault of its own.
    let has_failed = flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set();
    let mut slots = Slots { flash: Flash::new(p.FLASH), rcc: &p.RCC, pwr: &p.PWR };
    if let Some(slot) = select(&mut slots, has_failed) {
        start(FLASH_BASE + slot.firmware().start);
    }
    enable_peripherals(&p.RCC);
    if let Some((led, lit)) = BOARD.led {
        led.output(!lit);
        for k in (0..8).cycle() {
            led.set(lit == (PATTERN >> k & 1 != 0));
            cortex_m::asm::delay(EIGHTH);
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// Starts the image whose vectors are at this address.
fn start(vectors: u32) -> ! {
    // SAFETY: the image is whole. Its start expects the state after a reset, from which nothing here differs but
    // the watchdog; no interrupt is enabled.
    unsafe {
        (*SCB::PTR).vtor.write(vectors);
        cortex_m::asm::bootload(vectors as *const u32)
    }
}

/// The slots for firmware, of which the boot loader programs words of the trailers alone.
struct Slots<'a> {
    flash: Flash,
    rcc: &'a pac::RCC,
    pwr: &'a pac::PWR,
}

fn inside(offset: u32, len: usize) -> Result<u32, FlashError> {
    let fits = |slot: Slot| {
        let range = slot.firmware();
        range.contains(&offset) && len <= (range.end - offset) as usize
    };
    if Slot::ALL.into_iter().any(fits) { Ok(offset) } else { Err(FlashError::OutOfBounds) }
}

impl ErrorType for Slots<'_> {
    type Error = FlashError;
}

impl ReadNorFlash for Slots<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        // SAFETY: inside the flash, and copied at once: nothing writes meanwhile.
        bytes.copy_from_slice(unsafe { Flash::mapped(inside(offset, bytes.len())?, bytes.len()) });
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS.iter().sum::<u32>() as usize
    }
}

impl NorFlash for Slots<'_> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = TRAILER;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), FlashError> {
        Err(FlashError::OutOfBounds)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        if !supply::wait(self.rcc, self.pwr) {
            return Err(FlashError::SupplyLow);
        }
        self.flash.write(inside(offset, bytes.len())?, bytes)
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}
