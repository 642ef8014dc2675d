//! The independent watchdog (RM0090 21): it resets a board whose tasks no longer all run.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use stm32f4::stm32f405 as pac;

/// Its own oscillator, 17 to 47 kHz, over 256.
const DIVIDER: u8 = 6;
/// 500 / 125 Hz = 4 s; 2.7 s at worst. Erasing a weight slot stops the processor for 2 s at
/// most (datasheet, table 41).
const RELOAD: u16 = 500;

/// Runs until the next reset.
pub struct Watchdog(pac::IWDG);

impl Watchdog {
    /// Starts it. It stands still while a debugger has stopped the processor.
    pub fn start(iwdg: pac::IWDG, dbgmcu: &pac::DBGMCU) -> Self {
        dbgmcu.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
        iwdg.kr().write(|w| w.key().start());
        // Taken over a few of its cycles later; it counts with the longest time until then.
        // SAFETY: the key that unlocks both registers, and values within them.
        unsafe {
            iwdg.kr().write(|w| w.key().unlock());
            iwdg.pr().write(|w| w.bits(DIVIDER.into()));
            iwdg.rlr().write(|w| w.bits(RELOAD));
        }
        let mut watchdog = Self(iwdg);
        watchdog.feed();
        watchdog
    }

    /// Gives the tasks another 4 s.
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}
