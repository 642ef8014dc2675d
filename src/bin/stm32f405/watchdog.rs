//! The independent watchdog (RM0090 21), which resets a board if one of its tasks no longer runs.
//!
//! Its oscillator runs at 17 to 47 kHz (DS8626 table 40). Prescaler and reload value take effect up to five of its
//! cycles after the write. A reload before that would start the count at the old value, so [`set`] waits for both
//! before it reloads.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::{pac, wait_until};
use core::sync::atomic::{AtomicBool, Ordering};

/// Polls before the change of a register times out: above 300 us at 168 MHz, which 17 kHz needs.
const POLLS: u32 = 10_000;

/// Times until the reset, at 47, 32 and 17 kHz; without the crystal the processor is 10.5 times slower.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// 2.7, 4 and 7.5 s, without the crystal twice as long: the start, the check of a file or a signature, and an erase
    /// of a sector, which stalls the processor for up to 2 s (DS8626 table 48).
    Long,
    /// 68, 100 and 188 ms, without the crystal 0.7, 1.05 and 2 s: all tasks run.
    Short,
}

impl Limit {
    const fn settings(self, slow: bool) -> (u8, u16) {
        match (self, slow) {
            // 32 kHz / 256 = 125 Hz.
            (Self::Long, false) => (6, 500),
            (Self::Long, true) => (6, 1_000),
            // 32 kHz / 4 = 8 kHz.
            (Self::Short, false) => (0, 800),
            // 32 kHz / 64 = 500 Hz.
            (Self::Short, true) => (4, 525),
        }
    }
}

fn registers() -> &'static pac::iwdg::RegisterBlock {
    // SAFETY: always mapped. Keys are single writes; the one sequence of writes runs with interrupts off.
    unsafe { &*pac::IWDG::ptr() }
}

/// Starts the watchdog with the long limit; it runs until the next reset. It is frozen while a debugger has stopped
/// the processor.
pub fn start(dbgmcu: &pac::DBGMCU) {
    dbgmcu.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    registers().kr().write(|w| w.key().start());
    set(Limit::Long);
}

/// True while the long limit is set.
static LONG: AtomicBool = AtomicBool::new(true);
/// True if the processor does not run from the crystal.
static SLOW: AtomicBool = AtomicBool::new(false);

/// Makes the limits follow the processor's clock.
pub fn follow(is_exact: bool) {
    SLOW.store(!is_exact, Ordering::Relaxed);
    set(Limit::Long);
}

/// Runs `work`, which takes up to 2 s (5 s without the crystal), with the long limit, and then restores the previous limit.
pub fn with_long_limit<T>(work: impl FnOnce() -> T) -> T {
    let long = LONG.load(Ordering::Relaxed);
    set(Limit::Long);
    let result = work();
    set(if long { Limit::Long } else { Limit::Short });
    result
}

/// Changes the limit and begins a new period.
pub fn set(limit: Limit) {
    LONG.store(limit == Limit::Long, Ordering::Relaxed);
    let (prescaler, reload) = limit.settings(SLOW.load(Ordering::Relaxed));
    wait_until_applied();
    // A reload by the output task in between would lock both registers again.
    // SAFETY: the key that unlocks both registers, and values within them (RM0090 21.4).
    cortex_m::interrupt::free(|_| unsafe {
        registers().kr().write(|w| w.key().unlock());
        registers().pr().write(|w| w.bits(prescaler.into()));
        // reset value: 0x0FFF, every bit is written
        registers().rlr().write(|w| w.bits(reload));
    });
    wait_until_applied();
    feed();
}

fn wait_until_applied() {
    wait_until(POLLS, || {
        let status = registers().sr().read();
        status.pvu().bit_is_clear() && status.rvu().bit_is_clear()
    });
}

pub fn feed() {
    registers().kr().write(|w| w.key().feed());
}
