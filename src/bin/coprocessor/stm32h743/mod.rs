//! An STM32H743, revision V (RM0433): its clocks, pins and peripherals.
//!
//! The second part, which shows what porting takes; it is built in CI and has been run nowhere. The
//! pins are those of the STM32F405. Its flash is not written: it takes words of 32 bytes, and the
//! records of `gyronet::store` are made of words of four.

#![allow(unsafe_code, reason = "the caches' registers; the block says why it is sound")]

pub mod bus;
mod clocks;
pub mod flash;
pub mod spi;
mod usart;
pub mod watchdog;

pub use stm32h7::stm32h743v as pac;

use crate::board::{Chip, most_telling};
use crate::clock::Clocks;
use crate::start::WHEELS;
use bus::Bus;
use gyronet::service::event::ResetCause;
use gyronet::store::ImuPart;
use watchdog::Watchdog;

/// What is driven.
pub const PARTS: &[ImuPart] = &[ImuPart::XsensMti];
/// Raised by frames that have come.
pub const CAN_INTERRUPT: pac::Interrupt = pac::Interrupt::FDCAN1_IT0;

impl Chip {
    /// Starts clocks, pins, CAN and watchdog.
    pub fn start(p: pac::Peripherals) -> Self {
        caches();
        let clocks = Clocks::start(&p.RCC, &p.FLASH, &p.PWR);
        p.RCC.ahb4enr().modify(|_, w| w.gpioaen().enabled().gpioben().enabled().gpiocen().enabled());
        p.RCC.apb1lenr().modify(|_, w| w.usart2en().enabled().usart3en().enabled());
        p.RCC.apb1henr().modify(|_, w| w.fdcanen().enabled());
        p.RCC.apb2enr().modify(|_, w| w.usart1en().enabled().usart6en().enabled());
        pins(&p.GPIOA, &p.GPIOB, &p.GPIOC);
        let can = if clocks.exact() { Bus::start(p.FDCAN1, Some(&WHEELS)) } else { None };
        let id = p.DBGMCU.idc().read().bits();
        let watchdog = Watchdog::start(p.IWDG, &p.DBGMCU);
        Self {
            clocks,
            can,
            spi: None,
            watchdog,
            device_id: (id != 0).then_some(id),
            reset: reset_cause(&p.RCC),
        }
    }
}

/// Code and weights come from a flash of two wait states. No DMA works behind the caches' back.
fn caches() {
    // SAFETY: before the first interrupt, and nobody else uses these registers.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

fn pins(a: &pac::GPIOA, b: &pac::GPIOB, c: &pac::GPIOC) {
    a.afrl().modify(|_, w| w.afr2().af7().afr3().af7());
    a.afrh().modify(|_, w| w.afr9().af7().afr10().af7());
    b.afrh().modify(|_, w| w.afr8().af9().afr9().af9().afr10().af7().afr11().af7());
    c.afrl().modify(|_, w| w.afr6().af7().afr7().af7());
    a.moder().modify(|_, w| {
        w.moder2().alternate().moder3().alternate().moder9().alternate().moder10().alternate()
    });
    // A line that hangs open reads as idle.
    a.pupdr().modify(|_, w| w.pupdr3().pull_up().pupdr10().pull_up());
    b.moder().modify(|_, w| {
        w.moder8().alternate().moder9().alternate().moder10().alternate().moder11().alternate()
    });
    b.pupdr().modify(|_, w| w.pupdr11().pull_up());
    c.moder().modify(|_, w| w.moder6().alternate().moder7().alternate());
    c.pupdr().modify(|_, w| w.pupdr7().pull_up());
}

/// Reads the reset flags and clears them for the next time, the most telling one first.
fn reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.rsr().read();
    let causes = [
        (flags.iwdg1rstf().bit_is_set() || flags.wwdg1rstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set(), ResetCause::LowPower),
        (flags.porrstf().bit_is_set(), ResetCause::PowerOn),
        (flags.borrstf().bit_is_set(), ResetCause::BrownOut),
        (flags.pinrstf().bit_is_set(), ResetCause::Pin),
    ];
    rcc.rsr().modify(|_, w| w.rmvf().set_bit());
    most_telling(causes)
}
