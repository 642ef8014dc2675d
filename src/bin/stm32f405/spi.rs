//! SPI1 (RM0090 28) with the chip selects of one sensor, polled.
//!
//! Every wait has a limit, so a transaction ends whatever the controller does.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::pins::{self, Pin, Speed};
use super::{pac, wait_until};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};

/// Polls before a byte times out. A byte takes 1.5 us, about 20 polls.
const POLLS: u32 = 1_000;

/// A handle of the controller, which [`start`] has initialised, with a chip select. Whoever holds the handles is the only
/// user of the controller.
#[derive(Debug, Clone, Copy)]
pub struct Spi {
    select: Pin,
}

/// Starts mode 3 at 84 / 16 = 5.25 MHz (1 MHz on the internal oscillator); an ICM-42688-P allows 24 MHz, a
/// BMI088 or an ASM330LHH 10 MHz. Pins are the clock, data in, data out, and two chip selects.
pub fn start(spi: &pac::SPI1, [clock, input, output, selects @ ..]: [Pin; 5]) -> [Spi; 2] {
    // At low speed the edges are too slow for 5 MHz, and the last bit of a transfer can be corrupted
    // (ES0182 2.11).
    for pin in [clock, input, output] {
        pin.alternate(pins::SPI_1, Speed::Fast);
    }
    selects.iter().for_each(|select| select.output(true));
    spi.cr1().write(|w| {
        w.mstr().master().br().div16().cpol().idle_high().cpha().second_edge();
        w.ssm().enabled().ssi().slave_not_selected().spe().enabled()
    });
    selects.map(|select| Spi { select })
}

impl Spi {
    fn byte(self, byte: u8) -> Result<u8, ErrorKind> {
        // SAFETY: see the type.
        let spi = unsafe { &*pac::SPI1::ptr() };
        wait_for(|| spi.sr().read().txe().bit_is_set())?;
        // SAFETY: the data register takes any byte.
        spi.dr().write(|w| unsafe { w.bits(byte.into()) });
        wait_for(|| spi.sr().read().rxne().bit_is_set())?;
        Ok(spi.dr().read().bits() as u8)
    }

    fn operate(self, operation: &mut Operation<'_, u8>) -> Result<(), ErrorKind> {
        match operation {
            Operation::Read(bytes) => bytes.iter_mut().try_for_each(|to| self.byte(0).map(|byte| *to = byte)),
            Operation::Write(bytes) => bytes.iter().try_for_each(|byte| self.byte(*byte).map(drop)),
            Operation::TransferInPlace(bytes) => {
                bytes.iter_mut().try_for_each(|byte| self.byte(*byte).map(|read| *byte = read))
            }
            // No part of this image uses them.
            Operation::Transfer(..) | Operation::DelayNs(_) => Err(ErrorKind::Other),
        }
    }
}

impl ErrorType for Spi {
    type Error = ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        self.select.set(false);
        let done = operations.iter_mut().try_for_each(|operation| self.operate(operation));
        self.select.set(true);
        done
    }
}

fn wait_for(is_ready: impl Fn() -> bool) -> Result<(), ErrorKind> {
    wait_until(POLLS, is_ready).then_some(()).ok_or(ErrorKind::Other)
}
