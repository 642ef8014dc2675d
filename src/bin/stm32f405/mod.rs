//! Drivers of the STM32F405 (RM0090): its clocks, pins and peripherals, one file each.
//!
//! Every wait in here has a limit, and a timeout is reported. A register that is written as a whole begins at its
//! reset value (svd2rust's `write`), so a line that writes a register with a nonzero reset value states that value,
//! and a test checks it.

pub mod can;
pub mod clocks;
pub mod crystal;
pub mod dma;
pub mod flash;
pub mod pins;
pub mod reset;
pub mod rng;
pub mod serial_number;
pub mod spi;
pub mod supply;
pub mod timer;
pub mod usart;
pub mod watchdog;

pub use stm32f4::stm32f405 as pac;

use clocks::Clocks;
use gyronet::service::event::ResetCause;

pub struct Chip {
    /// Frequencies, and the reason if they are not the full ones.
    pub clocks: Clocks,
    /// DBGMCU_IDCODE (RM0090 38.6.1).
    pub device_id: u32,
    /// The reason why the chip has started.
    pub reset: ResetCause,
}

impl Chip {
    /// Starts the watchdog, the clock tree, board time and the clocks of all peripherals in use.
    pub fn start(p: &pac::Peripherals, crystal_hz: u32) -> Self {
        watchdog::start(&p.DBGMCU);
        let device_id = p.DBGMCU.idcode().read().bits();
        let reset = reset::cause(&p.RCC);
        let clocks = Clocks::start(&p.RCC, &p.FLASH, &p.PWR, crystal_hz);
        watchdog::follow(clocks.exact());
        if clocks.exact() {
            clocks::enable_prefetch(&p.FLASH, device_id);
        }
        timer::start(&p.RCC, &p.TIM5, &clocks);
        enable_peripherals(&p.RCC);
        Self { clocks, device_id, reset }
    }
}

/// Waits until a peripheral's clock that was switched on is running: 1 + 4 cycles of the slowest bus' prescaler
/// (ES0182 2.1.13).
pub fn clock_delay() {
    cortex_m::asm::dsb();
    cortex_m::asm::delay(16);
}

/// Waits until `is_ready`, for `polls` polls at most; returns whether it was.
pub fn wait_until(polls: u32, is_ready: impl Fn() -> bool) -> bool {
    (0..polls).any(|_| is_ready())
}

/// Switches on the clocks of all peripherals in use.
pub fn enable_peripherals(rcc: &pac::RCC) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioaen().enabled().gpioben().enabled().gpiocen().enabled().gpioden().enabled().gpioeen().enabled();
        w.dma1en().enabled().dma2en().enabled()
    });
    rcc.ahb2enr().modify(|_, w| w.rngen().enabled());
    rcc.apb1enr()
        .modify(|_, w| w.usart2en().enabled().usart3en().enabled().uart4en().enabled().can1en().enabled());
    rcc.apb2enr()
        .modify(|_, w| w.usart1en().enabled().usart6en().enabled().spi1en().enabled().syscfgen().enabled());
    clock_delay();
}
