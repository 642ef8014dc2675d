//! Measures the time of a region of code, and its stack use.

#![allow(unsafe_code, reason = "marker instructions and stack painting; each block says why it is sound")]

use core::arch::asm;
use cortex_m::peripheral::{DCB, DWT};
use cortex_m_semihosting::hprintln;

const PAINT: u32 = 0xC0DE_57AC;

unsafe extern "C" {
    /// End of the stack (memory.x); there is no memory below it.
    static _stack_end: u32;
}

fn stack_end() -> usize {
    (&raw const _stack_end).addr()
}

pub struct Meter {
    dwt: bool,
}

impl Meter {
    pub fn new(mut dcb: DCB, mut dwt: DWT) -> Self {
        dcb.enable_trace();
        dwt.enable_cycle_counter();
        let before = DWT::cycle_count();
        cortex_m::asm::delay(100);
        // The emulator has the register, but the count does not change.
        Self { dwt: DWT::cycle_count() != before }
    }

    /// Runs `work` between the markers and prints a line with the stack it used and, on a board, its cycles.
    #[inline(never)]
    pub fn run(&mut self, name: &str, mut work: impl FnMut()) {
        let frame = 0u32;
        paint();
        let cycles = DWT::cycle_count();
        // SAFETY: DBG is a hint; without a debugger that listens it does nothing.
        unsafe { asm!(".inst.w 0xF3AF80F1") };
        work();
        // SAFETY: as above.
        unsafe { asm!(".inst.w 0xF3AF80F2") };
        let cycles = DWT::cycle_count().wrapping_sub(cycles);
        let stack = core::ptr::from_ref(&frame).addr() - lowest_written();
        if self.dwt {
            hprintln!("{} cycles={} stack={}", name, cycles, stack);
        } else {
            hprintln!("{} stack={}", name, stack);
        }
    }
}

#[inline(never)]
fn paint() {
    let here = 0u32;
    // Start 64 bytes below this frame, so that the loop does not paint over itself.
    let top = core::ptr::from_ref(&here).addr() - 64;
    for address in (stack_end()..top).step_by(4) {
        // SAFETY: RAM between the stack's end and this frame, where nothing lives.
        unsafe { core::ptr::with_exposed_provenance_mut::<u32>(address).write_volatile(PAINT) };
    }
}

/// Returns the lowest stack address that was written since the last `paint`.
#[inline(never)]
fn lowest_written() -> usize {
    let painted = |address: &usize| {
        // SAFETY: as in `paint`.
        unsafe { core::ptr::with_exposed_provenance::<u32>(*address).read_volatile() == PAINT }
    };
    let end = stack_end();
    end + 4 * (end..).step_by(4).take_while(painted).count()
}
