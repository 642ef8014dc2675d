//! Prints lines on USART6 and over RTT.

use crate::boards::BOARD;
use crate::stm32f405::pins;
use crate::stm32f405::usart::Usart;
use crate::stm32f405::{Chip, wait_until, watchdog};
use core::fmt::{self, Write};

/// Polls before a byte is dropped: several byte times at 115200 baud.
const POLLS: u32 = 100_000;

pub struct Report {
    usart: Usart,
    failed: u32,
}

impl Report {
    pub fn start(chip: &Chip) -> Self {
        rtt_target::rtt_init_print!();
        let line = &BOARD.service;
        line.connect(pins::UART_4_AND_6);
        let mut report = Self::attach();
        let baud = if chip.clocks.exact() { line.baud } else { line.fallback_baud };
        report.usart.start(chip.clocks.apb2_hz, baud);
        report.print(format_args!(
            "\ngyronet bringup {}, {}, STM32F405 {:#010x}, started by {}",
            env!("CARGO_PKG_VERSION"),
            BOARD.name,
            chip.device_id,
            chip.reset
        ));
        report
    }

    /// Returns a report on the outputs without starting them; also for a panic.
    pub fn attach() -> Self {
        Self { usart: Usart::six(), failed: 0 }
    }

    pub fn print(&mut self, text: fmt::Arguments<'_>) {
        watchdog::feed();
        rtt_target::rprintln!("{}", text);
        // Neither output reports errors: a byte that is not accepted in time is dropped.
        let _ = self.write_fmt(text);
        let _ = self.write_str("\r\n");
    }

    pub fn pass(&mut self, what: &str, text: fmt::Arguments<'_>) {
        self.print(format_args!("{what:<12} PASS  {text}"));
    }

    pub fn fail(&mut self, what: &str, text: fmt::Arguments<'_>) {
        self.failed += 1;
        self.print(format_args!("{what:<12} FAIL  {text}"));
    }

    /// Reports what a person must check, or what needs a wire or a sensor.
    pub fn manual_check(&mut self, what: &str, text: fmt::Arguments<'_>) {
        self.print(format_args!("{what:<12} ----  {text}"));
    }

    pub fn failed(&self) -> u32 {
        self.failed
    }

    /// Blinks forever, after everything has been reported.
    pub fn end(&mut self) -> ! {
        if let Some((led, lit)) = BOARD.led {
            led.output(!lit);
        }
        loop {
            for on in [true, false] {
                if let Some((led, lit)) = BOARD.led {
                    led.set(lit == on);
                }
                watchdog::feed();
                cortex_m::asm::delay(10_000_000);
            }
        }
    }
}

impl Write for Report {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if wait_until(POLLS, || self.usart.status().room()) {
                self.usart.write(byte);
            }
        }
        Ok(())
    }
}
