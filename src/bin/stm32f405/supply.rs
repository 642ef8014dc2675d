//! Supervises the supply (RM0090 5.2): programmable voltage detector and brown-out reset.
//!
//! Programming flash in words needs 2.7 V, as does 168 MHz at five wait states. Level 6 of the detector trips at 2.85
//! to 2.99 V when the supply falls, and clears at 3.10 V at most when it rises (DS8626 table 19). So the chip stops
//! before either limit is reached, and a supply of 3.3 V - 5 % is above the level. Level 5 can trip at 2.65 V, and
//! level 7 may clear only at 3.21 V.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::{clock_delay, pac, wait_until};

/// PLS for 3.03 V rising, 2.93 V falling.
const LEVEL: u8 = 6;
/// EXTI line of the detector's output.
const LINE: u32 = 1 << 16;
/// Polls of the detector in 100 ms at 16 MHz.
const POLLS: u32 = 100;
const CYCLES_PER_POLL: u32 = 16_000;

/// Starts the detector and waits up to 100 ms at the reset clock for the supply; returns whether it is high enough.
pub fn wait(rcc: &pac::RCC, pwr: &pac::PWR) -> bool {
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    clock_delay();
    // SAFETY: the level is one of the eight.
    pwr.cr().modify(|_, w| unsafe { w.pls().bits(LEVEL).pvde().set_bit() });
    wait_until(POLLS, || {
        cortex_m::asm::delay(CYCLES_PER_POLL);
        !is_low()
    })
}

pub fn is_low() -> bool {
    // SAFETY: the register is only read.
    unsafe { &*pac::PWR::ptr() }.csr().read().pvdo().bit_is_set()
}

/// Enables the interrupt PVD for a falling supply.
pub fn watch(exti: &pac::EXTI) {
    // SAFETY: line 16 is the detector (RM0090 12.2.5). Its output rises when the supply falls.
    unsafe {
        exti.rtsr().modify(|r, w| w.bits(r.bits() | LINE));
        // Ones clear a pending edge, zeros leave the others.
        exti.pr().write(|w| w.bits(LINE));
        exti.imr().modify(|r, w| w.bits(r.bits() | LINE));
    }
}
