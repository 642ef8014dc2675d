//! The independent watchdog (RM0090 21), which resets a board whose tasks no longer all run.
//!
//! Its oscillator gives 17 to 47 kHz (DS8626 table 40). Prescaler and reload are taken over up to
//! five of its cycles after the write, and a reload before that starts the count at the old value:
//! [`set`] waits for both before it reloads.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::pac;
use core::sync::atomic::{AtomicBool, Ordering};

/// Polls for a register to be taken over: above 300 us at 168 MHz and 17 kHz.
const POLLS: u32 = 10_000;

/// Times until the reset, at 47, 32 and 17 kHz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// 2.7, 4 and 7.5 s: the start, and an erase of a sector, which stalls the processor for up to 2 s
    /// (DS8626 table 48).
    Long,
    /// 68, 100 and 188 ms: all tasks run.
    Short,
}

impl Limit {
    /// Prescaler code and reload value.
    const fn settings(self) -> (u8, u16) {
        match self {
            // 32 kHz / 256 = 125 Hz.
            Self::Long => (6, 500),
            // 32 kHz / 4 = 8 kHz.
            Self::Short => (0, 800),
        }
    }
}

fn registers() -> &'static pac::iwdg::RegisterBlock {
    // SAFETY: always mapped. Keys are single writes; the one sequence of writes runs with interrupts off.
    unsafe { &*pac::IWDG::ptr() }
}

/// Starts the watchdog with the long limit; it runs until the next reset. It stands still while a debugger
/// has stopped the processor.
pub fn start(dbgmcu: &pac::DBGMCU) {
    dbgmcu.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    registers().kr().write(|w| w.key().start());
    set(Limit::Long);
}

/// True while the long limit counts.
static LONG: AtomicBool = AtomicBool::new(true);

/// Does something that takes up to 2 s with the long limit, and goes back to the limit before it.
pub fn lengthened<T>(work: impl FnOnce() -> T) -> T {
    let long = LONG.load(Ordering::Relaxed);
    set(Limit::Long);
    let result = work();
    set(if long { Limit::Long } else { Limit::Short });
    result
}

/// Changes the limit and begins a new period.
pub fn set(limit: Limit) {
    LONG.store(limit == Limit::Long, Ordering::Relaxed);
    let (prescaler, reload) = limit.settings();
    taken_over();
    // A reload by the output task in between would lock both registers again.
    // SAFETY: the key that unlocks both registers, and values within them (RM0090 21.4).
    cortex_m::interrupt::free(|_| unsafe {
        registers().kr().write(|w| w.key().unlock());
        registers().pr().write(|w| w.bits(prescaler.into()));
        // reset value: 0x0FFF, every bit is written
        registers().rlr().write(|w| w.bits(reload));
    });
    taken_over();
    feed();
}

/// Waits, in a bounded number of polls, until the last values count.
fn taken_over() {
    let _ = (0..POLLS).any(|_| {
        let status = registers().sr().read();
        status.pvu().bit_is_clear() && status.rvu().bit_is_clear()
    });
}

/// Begins a new period.
pub fn feed() {
    registers().kr().write(|w| w.key().feed());
}
