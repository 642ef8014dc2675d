//! Clock tree of the STM32F405 (RM0090 7.3, PM0214 4.5).
//!
//! 168 MHz from the crystal. Every step is waited for with a limit; where one does not come
//! (a broken crystal, a supply below 2.9 V, the emulator, whose RCC reads as zero) the board
//! stays on the reset clock of 16 MHz and says so.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use crate::clock::{Clocks, within};
use stm32f4::stm32f405 as pac;

/// The crystal of a Netduino Plus 2, which is what the emulator is.
const HSE_MHZ: u8 = 25;
const RESET_HZ: u32 = 16_000_000;
const FULL_HZ: u32 = 168_000_000;

impl Clocks {
    /// The reset clock: 1 % off at best, which a UART bears and CAN does not.
    const RESET: Self = Self { core_hz: RESET_HZ, apb1_hz: RESET_HZ, apb2_hz: RESET_HZ };
    pub const FULL: Self = Self { core_hz: FULL_HZ, apb1_hz: FULL_HZ / 4, apb2_hz: FULL_HZ / 2 };

    /// Starts the crystal and the PLL; the reset clock where they do not come.
    pub fn start(rcc: &pac::RCC, flash: &pac::FLASH, pwr: &pac::PWR) -> Self {
        rcc.apb1enr().modify(|_, w| w.pwren().enabled());
        // SAFETY: level 7 of 7: 2.9 V, where 168 MHz is still allowed (datasheet, table 14).
        pwr.cr().modify(|_, w| unsafe { w.pls().bits(7).pvde().set_bit() });
        if Self::switch(rcc, flash, pwr).is_some() {
            return Self::FULL;
        }
        rcc.cfgr().modify(|_, w| w.sw().hsi().hpre().div1().ppre1().div1().ppre2().div1());
        rcc.cr().modify(|_, w| w.pllon().off().hseon().off());
        Self::RESET
    }

    fn switch(rcc: &pac::RCC, flash: &pac::FLASH, pwr: &pac::PWR) -> Option<()> {
        if pwr.csr().read().pvdo().bit_is_set() {
            return None;
        }
        rcc.cr().modify(|_, w| w.hseon().on());
        within(|| rcc.cr().read().hserdy().is_ready())?;
        // 25 MHz / 25 * 336 / 2 = 168 MHz, / 7 = 48 MHz.
        // SAFETY: dividers and multiplier within RM0090 7.3.2.
        rcc.pllcfgr().write(|w| unsafe {
            w.pllsrc().hse().pllm().bits(HSE_MHZ).plln().bits(336).pllp().div2().pllq().bits(7)
        });
        rcc.cr().modify(|_, w| w.pllon().on());
        within(|| rcc.cr().read().pllrdy().is_ready())?;
        flash.acr().modify(|_, w| w.latency().ws5().prften().enabled().icen().enabled().dcen().enabled());
        within(|| flash.acr().read().latency().is_ws5())?;
        rcc.cfgr().modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
        rcc.cfgr().modify(|_, w| w.sw().pll());
        within(|| rcc.cfgr().read().sws().is_pll())?;
        // A crystal that stops later raises the NMI, which resets with its reason.
        rcc.cr().modify(|_, w| w.csson().on());
        Some(())
    }
}
