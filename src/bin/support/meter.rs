//! Counts what a region costs, its stack included.

#![allow(unsafe_code, reason = "marker instructions and stack painting; each block says why it is sound")]

use core::arch::asm;
use cortex_m::peripheral::{DCB, DWT, SYST, syst::SystClkSource};
use cortex_m_semihosting::hprintln;

const PAINT: u32 = 0xC0DE_57AC;
/// Words painted below the stack pointer: 24 KiB, which is free in every image here.
const PAINTED: usize = 6 * 1024;

pub struct Meter {
    syst: SYST,
    dwt: bool,
}

impl Meter {
    pub fn new(mut syst: SYST, mut dcb: DCB, mut dwt: DWT) -> Self {
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(0x00FF_FFFF);
        syst.clear_current();
        syst.enable_counter();
        dcb.enable_trace();
        dwt.enable_cycle_counter();
        let before = DWT::cycle_count();
        cortex_m::asm::delay(100);
        // The emulator has the register, but it stands still.
        Self { syst, dwt: DWT::cycle_count() != before }
    }

    /// Runs `work` between the markers and prints its line, the stack it used included.
    #[inline(never)]
    pub fn run(&mut self, name: &str, mut work: impl FnMut()) {
        let frame = 0u32;
        let bottom = paint();
        let (ticks, cycles) = (SYST::get_current(), DWT::cycle_count());
        // SAFETY: DBG is a hint; without a debugger that listens it does nothing.
        unsafe { asm!(".inst.w 0xF3AF80F1") };
        work();
        // SAFETY: as above.
        unsafe { asm!(".inst.w 0xF3AF80F2") };
        let cycles = DWT::cycle_count().wrapping_sub(cycles);
        let ticks = ticks.wrapping_sub(SYST::get_current()) & 0x00FF_FFFF;
        let wrapped = self.syst.has_wrapped();
        let stack = core::ptr::from_ref(&frame).addr() - untouched(bottom);
        if self.dwt {
            hprintln!("{} cycles={} stack={}", name, cycles, stack);
        } else {
            hprintln!("{} ticks={} wrapped={} stack={}", name, ticks, wrapped, stack);
        }
    }
}

/// Fills what lies below the stack pointer; returns where that begins.
#[inline(never)]
fn paint() -> usize {
    let here = 0u32;
    // Some way below this frame, so that the loop does not paint over itself.
    let top = core::ptr::from_ref(&here).addr() - 64;
    let bottom = top - 4 * PAINTED;
    for address in (bottom..top).step_by(4) {
        // SAFETY: RAM between the statics and this frame that nothing lives in: the image's
        // statics end more than 24 KiB below its stack.
        unsafe { core::ptr::with_exposed_provenance_mut::<u32>(address).write_volatile(PAINT) };
    }
    bottom
}

/// The lowest address that was written since.
#[inline(never)]
fn untouched(bottom: usize) -> usize {
    let words = (0..PAINTED).take_while(|word| {
        let address = bottom + 4 * word;
        // SAFETY: as in `paint`.
        unsafe { core::ptr::with_exposed_provenance::<u32>(address).read_volatile() == PAINT }
    });
    bottom + 4 * words.count()
}
