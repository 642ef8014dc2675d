//! An STM32F405 (RM0090): its clocks, pins and peripherals.

pub mod bus;
mod clocks;
pub mod flash;
pub mod spi;
mod usart;
pub mod watchdog;

pub use stm32f4::stm32f405 as pac;

use crate::board::{Chip, most_telling};
use crate::clock::Clocks;
use crate::start::WHEELS;
use bus::Bus;
use gyronet::service::event::ResetCause;
use gyronet::store::ImuPart;
use spi::Spi;
use watchdog::Watchdog;

/// What is driven.
pub const PARTS: &[ImuPart] = &[ImuPart::XsensMti, ImuPart::Icm42688];
/// Raised by frames that have come.
pub const CAN_INTERRUPT: pac::Interrupt = pac::Interrupt::CAN1_RX0;

impl Chip {
    /// Starts clocks, pins, CAN and watchdog.
    pub fn start(p: pac::Peripherals) -> Self {
        let clocks = Clocks::start(&p.RCC, &p.FLASH, &p.PWR);
        p.RCC.ahb1enr().modify(|_, w| w.gpioaen().enabled().gpioben().enabled().gpiocen().enabled());
        p.RCC.apb1enr().modify(|_, w| w.usart2en().enabled().usart3en().enabled().can1en().enabled());
        p.RCC.apb2enr().modify(|_, w| w.usart1en().enabled().usart6en().enabled());
        pins(&p.GPIOA, &p.GPIOB, &p.GPIOC);
        let can = if clocks.exact() { Bus::start(p.CAN1, Some(&WHEELS)) } else { None };
        let spi = Spi::start(&p.RCC, &p.GPIOA, &p.SPI1);
        let id = p.DBGMCU.idcode().read().bits();
        let watchdog = Watchdog::start(p.IWDG, &p.DBGMCU);
        Self { clocks, can, spi, watchdog, device_id: (id != 0).then_some(id), reset: reset_cause(&p.RCC) }
    }
}

fn pins(a: &pac::GPIOA, b: &pac::GPIOB, c: &pac::GPIOC) {
    a.afrl().modify(|_, w| w.afrl2().af7().afrl3().af7());
    a.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
    b.afrh().modify(|_, w| w.afrh8().af9().afrh9().af9().afrh10().af7().afrh11().af7());
    c.afrl().modify(|_, w| w.afrl6().af8().afrl7().af8());
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
    let flags = rcc.csr().read();
    let causes = [
        (flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set(), ResetCause::LowPower),
        (flags.porrstf().bit_is_set(), ResetCause::PowerOn),
        (flags.borrstf().bit_is_set(), ResetCause::BrownOut),
        (flags.padrstf().bit_is_set(), ResetCause::Pin),
    ];
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    most_telling(causes)
}
