//! Clock tree of the STM32H743 (RM0433 8 and 6.6.1).
//!
//! 400 MHz from the crystal, at voltage scale 1. Every step is waited for with a limit; where one
//! does not come the board stays on the reset clock of 64 MHz and says so.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use crate::clock::{Clocks, within};
use stm32h7::stm32h743v as pac;

/// The crystal.
const HSE_MHZ: u8 = 25;
const RESET_HZ: u32 = 64_000_000;
const FULL_HZ: u32 = 400_000_000;
/// Voltage scale 1 (RM0433, PWR_D3CR).
const SCALE_1: u8 = 3;
/// Of a bus clock of 200 MHz at scale 1 (RM0433, table 17).
const WAIT_STATES: u8 = 2;

impl Clocks {
    /// The reset clock, which a UART bears and CAN does not.
    const RESET: Self = Self { core_hz: RESET_HZ, apb1_hz: RESET_HZ, apb2_hz: RESET_HZ };
    pub const FULL: Self = Self { core_hz: FULL_HZ, apb1_hz: FULL_HZ / 4, apb2_hz: FULL_HZ / 4 };

    /// Starts the crystal and the PLL; the reset clock where they do not come.
    pub fn start(rcc: &pac::RCC, flash: &pac::FLASH, pwr: &pac::PWR) -> Self {
        // SAFETY: level 6 of 6 (RM0433, PWR_CR1): 2.85 V.
        pwr.cr1().modify(|_, w| unsafe { w.pls().bits(6).pvde().set_bit() });
        if Self::switch(rcc, flash, pwr).is_some() {
            return Self::FULL;
        }
        rcc.cfgr().modify(|_, w| w.sw().hsi());
        rcc.d1cfgr().modify(|_, w| w.hpre().div1());
        rcc.d2cfgr().modify(|_, w| w.d2ppre1().div1().d2ppre2().div1());
        rcc.cr().modify(|_, w| w.pll1on().off().hseon().off());
        Self::RESET
    }

    fn switch(rcc: &pac::RCC, flash: &pac::FLASH, pwr: &pac::PWR) -> Option<()> {
        if pwr.csr1().read().pvdo().bit_is_set() {
            return None;
        }
        // The supply's way is chosen by the first write after power-on: the internal regulator.
        pwr.cr3().modify(|_, w| w.scuen().set_bit().ldoen().set_bit().bypass().clear_bit());
        within(|| pwr.csr1().read().actvosrdy().bit_is_set())?;
        // SAFETY: one of the scales.
        pwr.d3cr().modify(|_, w| unsafe { w.vos().bits(SCALE_1) });
        within(|| pwr.d3cr().read().vosrdy().bit_is_set())?;
        rcc.cr().modify(|_, w| w.hseon().on());
        within(|| rcc.cr().read().hserdy().is_ready())?;
        // 25 MHz / 5 * 160 / 2 = 400 MHz; the input of 5 MHz wants range 4 to 8 and the wide VCO.
        // SAFETY: a divider within RM0433 8.7.13.
        rcc.pllckselr().modify(|_, w| unsafe { w.pllsrc().hse().divm1().bits(HSE_MHZ / 5) });
        rcc.pllcfgr().modify(|_, w| {
            w.pll1rge().range4().pll1vcosel().wide_vco().pll1fracen().reset().divp1en().enabled()
        });
        // SAFETY: fields hold the factor less one (RM0433 8.7.15).
        rcc.pll1divr().modify(|_, w| unsafe { w.divn1().bits(160 - 1).divp1().div2() });
        rcc.cr().modify(|_, w| w.pll1on().on());
        within(|| rcc.cr().read().pll1rdy().is_ready())?;
        // SAFETY: both fields of two bits and more take 2 (RM0433, table 17).
        flash.acr().modify(|_, w| unsafe { w.latency().bits(WAIT_STATES).wrhighfreq().bits(2) });
        within(|| flash.acr().read().latency().bits() == WAIT_STATES)?;
        rcc.d1cfgr().modify(|_, w| w.d1cpre().div1().hpre().div2().d1ppre().div2());
        rcc.d2cfgr().modify(|_, w| w.d2ppre1().div2().d2ppre2().div2());
        rcc.d3cfgr().modify(|_, w| w.d3ppre().div2());
        rcc.cfgr().modify(|_, w| w.sw().pll1());
        within(|| rcc.cfgr().read().sws().is_pll1())?;
        // A crystal that stops later raises the NMI, which resets with its reason.
        rcc.cr().modify(|_, w| w.hsecsson().on());
        Some(())
    }
}
