//! This module supervises the supply (RM0090 5.2): programmable voltage detector and brown-out reset.
//!
//! Flash is programmed in words, which needs 2.7 V, and 168 MHz at five wait states needs the same.
//! The detector's level 6 falls at 2.85 to 2.99 V and rises at 3.10 V at most (DS8626 table 19), so the chip
//! stops before either limit is reached, and a supply of 3.3 V - 5 % is above it. Level 5 can fall at 2.65 V, and
//! level 7 can rise at 3.21 V.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::{clock_delay, pac};

/// PLS for 3.03 V rising, 2.93 V falling.
const LEVEL: u8 = 6;
/// EXTI line of the detector's output.
const LINE: u32 = 1 << 16;
/// Looks at the detector in 100 ms at 16 MHz.
const LOOKS: u32 = 100;
const CYCLES_PER_LOOK: u32 = 16_000;

/// Starts the detector and waits up to 100 ms at the reset clock for the supply; whether it came.
pub fn wait(rcc: &pac::RCC, pwr: &pac::PWR) -> bool {
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    clock_delay();
    // SAFETY: the level is one of the eight.
    pwr.cr().modify(|_, w| unsafe { w.pls().bits(LEVEL).pvde().set_bit() });
    (0..LOOKS).any(|_| {
        cortex_m::asm::delay(CYCLES_PER_LOOK);
        !is_low()
    })
}

/// Returns whether the supply is below the detector's level now.
pub fn is_low() -> bool {
    // SAFETY: the register is only read.
    unsafe { &*pac::PWR::ptr() }.csr().read().pvdo().bit_is_set()
}

/// Lets a falling supply raise the interrupt PVD.
pub fn watch(exti: &pac::EXTI) {
    // SAFETY: line 16 is the detector (RM0090 12.2.5). Its output rises when the supply falls.
    unsafe {
        exti.rtsr().modify(|r, w| w.bits(r.bits() | LINE));
        // Ones clear a pending edge, zeros leave the others.
        exti.pr().write(|w| w.bits(LINE));
        exti.imr().modify(|r, w| w.bits(r.bits() | LINE));
    }
}
