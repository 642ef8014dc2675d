//! Prints lines on USART6 and over RTT.

use crate::boards::BOARD;
use crate::stm32f405::pins::{self, Speed};
use crate::stm32f405::usart::Usart;
use crate::stm32f405::{Chip, watchdog};
use core::fmt::{self, Write};

/// Polls before a byte is given up: several byte times at 115200.
const POLLS: u32 = 100_000;

/// The place where lines go.
pub struct Report {
    usart: Usart,
    failed: u32,
}

impl Report {
    /// Starts both outputs and prints the heading.
    pub fn start(chip: &Chip) -> Self {
        rtt_target::rtt_init_print!();
        let line = &BOARD.service;
        line.rx.pull_up();
        line.rx.alternate(pins::USART_6, Speed::Low);
        line.tx.alternate(pins::USART_6, Speed::Low);
        let mut report = Self::again();
        let baud = if chip.clocks.exact() { line.baud } else { line.fallback_baud };
        report.usart.start(chip.clocks.apb2_hz, baud);
        report.print(format_args!(
            "\ngyronet bringup {}, {}, STM32F405 {:#010x}, started by {}",
            env!("CARGO_PKG_VERSION"),
            BOARD.name,
            chip.device_id.unwrap_or_default(),
            chip.reset
        ));
        report
    }

    /// Uses the outputs once more, for a panic.
    pub fn again() -> Self {
        Self { usart: Usart::six(), failed: 0 }
    }

    /// Prints a line.
    pub fn print(&mut self, text: fmt::Arguments<'_>) {
        watchdog::feed();
        rtt_target::rprintln!("{}", text);
        // Neither output gives an error: a byte that is not taken in time is left out.
        let _ = self.write_fmt(text);
        let _ = self.write_str("\r\n");
    }

    /// Reports a check that has passed.
    pub fn pass(&mut self, what: &str, text: fmt::Arguments<'_>) {
        self.print(format_args!("{what:<12} PASS  {text}"));
    }

    /// Reports a check that has failed.
    pub fn fail(&mut self, what: &str, text: fmt::Arguments<'_>) {
        self.failed += 1;
        self.print(format_args!("{what:<12} FAIL  {text}"));
    }

    /// Reports what a person must look at, or what needs a wire or a sensor.
    pub fn look(&mut self, what: &str, text: fmt::Arguments<'_>) {
        self.print(format_args!("{what:<12} ----  {text}"));
    }

    /// The number of checks that have failed.
    pub fn failed(&self) -> u32 {
        self.failed
    }

    /// Blinks for ever: everything has been reported.
    pub fn end(&mut self) -> ! {
        let (led, lit) = BOARD.led;
        led.output(!lit);
        loop {
            for level in [lit, !lit] {
                led.set(level);
                watchdog::feed();
                cortex_m::asm::delay(10_000_000);
            }
        }
    }
}

impl Write for Report {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if (0..POLLS).any(|_| self.usart.status().room()) {
                self.usart.write(byte);
            }
        }
        Ok(())
    }
}
