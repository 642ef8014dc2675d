//! The independent watchdog (RM0433 46): it resets a board whose tasks no longer all run.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use stm32h7::stm32h743v as pac;

/// 500 / 125 Hz = 4 s: its own oscillator of 32 kHz, over 256.
const RELOAD: u16 = 500;

/// Runs until the next reset.
pub struct Watchdog(pac::IWDG);

impl Watchdog {
    /// Starts it. It stands still while a debugger has stopped the processor.
    pub fn start(iwdg: pac::IWDG, dbgmcu: &pac::DBGMCU) -> Self {
        dbgmcu.apb4fz1().modify(|_, w| w.dbg_iwdg1().set_bit());
        iwdg.kr().write(|w| w.key().start());
        iwdg.kr().write(|w| w.key().unlock());
        // Taken over a few of its cycles later; it counts with the longest time until then.
        iwdg.pr().write(|w| w.pr().divide_by256());
        // SAFETY: a value of 12 bits.
        iwdg.rlr().write(|w| unsafe { w.bits(RELOAD) });
        let mut watchdog = Self(iwdg);
        watchdog.feed();
        watchdog
    }

    /// Gives the tasks another 4 s.
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}
