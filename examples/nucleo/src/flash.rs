//! The flash, for boot loader and image ([`gyronet::store::banks`]).

use core::ops::Range;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};
use cortex_m::peripheral::SCB;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::pac::{self, flash::vals::OptsrSwapBank};
use embassy_stm32::peripherals;
use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind as Kind};
use gyronet::store::banks::{BANK, Banks, QUAD, SECTOR};

const BASE: u32 = 0x0800_0000;
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

pub struct Array {
    driver: Flash<'static, Blocking>,
    /// Called after each sector that was erased.
    alive: fn(),
}

impl Array {
    /// # Safety
    /// All are used by the main program alone, one at a time.
    pub unsafe fn new(alive: fn()) -> Self {
        // SAFETY: see above.
        Self { driver: Flash::new_blocking(unsafe { peripherals::FLASH::steal() }), alive }
    }
}

impl Banks for Array {
    fn is_swapped(&self) -> bool {
        pac::FLASH.optsr_cur().read().swap_bank() == OptsrSwapBank::B_0X1
    }

    fn mapped(&self, range: Range<u32>) -> &[u8] {
        // SAFETY: the library asks for flash alone, and uses it while nothing is written.
        unsafe { core::slice::from_raw_parts((BASE + range.start) as *const u8, range.len()) }
    }

    fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), Kind> {
        IS_TORN.store(false, Relaxed);
        self.driver.blocking_read(at, bytes).map_err(|error| error.kind())?;
        cortex_m::asm::dsb();
        if IS_TORN.load(Relaxed) { Err(Kind::Other) } else { Ok(()) }
    }

    fn erase(&mut self, sector: u32) -> Result<(), Kind> {
        clear();
        // embassy's driver names the bank by the address, the controller by its place on the chip.
        let sector = if self.is_swapped() { sector ^ BANK } else { sector };
        let erased = self.driver.blocking_erase(sector, sector + SECTOR);
        (self.alive)();
        erased.map_err(|error| error.kind())
    }

    fn write(&mut self, at: u32, quad: &[u8; QUAD]) -> Result<(), Kind> {
        clear();
        self.driver.blocking_write(at, quad).map_err(|error| error.kind())
    }
}

/// Clears the flags of earlier operations, which embassy's driver writes to a read-only register.
fn clear() {
    pac::FLASH.nsccr().write(|w| w.0 = FLAGS);
}
