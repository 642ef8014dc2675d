//! SPI1 (RM0090 28) with one part on it, polled: PA5 clock, PA6 in, PA7 out, PA4 selects the part.
//!
//! Every wait has a limit, so a transaction ends whatever the controller does.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use stm32f4::stm32f405 as pac;

/// Polls before a byte is given up. It takes 1.5 us, some 20 polls.
const POLLS: u32 = 1_000;

/// The controller, which `Spi::start` has brought up. Whoever holds it uses it alone: `imu` hands
/// it back and forth.
#[derive(Debug, Clone, Copy)]
pub struct Spi(());

impl Spi {
    /// Mode 3 at 84 / 16 = 5.25 MHz (1 MHz on the reset clock); an ICM-42688-P takes 24.
    pub fn start(rcc: &pac::RCC, a: &pac::GPIOA, spi: &pac::SPI1) -> Option<Self> {
        rcc.apb2enr().modify(|_, w| w.spi1en().enabled());
        a.afrl().modify(|_, w| w.afrl5().af5().afrl6().af5().afrl7().af5());
        a.bsrr().write(|w| w.bs4().set_bit());
        a.moder().modify(|_, w| {
            w.moder4().output().moder5().alternate().moder6().alternate().moder7().alternate()
        });
        spi.cr1().write(|w| {
            w.mstr().master().br().div16().cpol().idle_high().cpha().second_edge();
            w.ssm().enabled().ssi().slave_not_selected().spe().enabled()
        });
        Some(Self(()))
    }

    fn byte(self, byte: u8) -> Result<u8, ErrorKind> {
        // SAFETY: see the type.
        let spi = unsafe { &*pac::SPI1::ptr() };
        within(|| spi.sr().read().txe().bit_is_set())?;
        // SAFETY: the data register takes any byte.
        spi.dr().write(|w| unsafe { w.bits(byte.into()) });
        within(|| spi.sr().read().rxne().bit_is_set())?;
        Ok(spi.dr().read().bits() as u8)
    }

    fn operate(self, operation: &mut Operation<'_, u8>) -> Result<(), ErrorKind> {
        match operation {
            Operation::Read(bytes) => bytes.iter_mut().try_for_each(|to| self.byte(0).map(|byte| *to = byte)),
            Operation::Write(bytes) => bytes.iter().try_for_each(|byte| self.byte(*byte).map(drop)),
            Operation::TransferInPlace(bytes) => {
                bytes.iter_mut().try_for_each(|byte| self.byte(*byte).map(|read| *byte = read))
            }
            // No part of this image asks for them.
            Operation::Transfer(..) | Operation::DelayNs(_) => Err(ErrorKind::Other),
        }
    }
}

impl ErrorType for Spi {
    type Error = ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        // SAFETY: writing ones here changes PA4 alone.
        let a = unsafe { &*pac::GPIOA::ptr() };
        a.bsrr().write(|w| w.br4().set_bit());
        let done = operations.iter_mut().try_for_each(|operation| self.operate(operation));
        a.bsrr().write(|w| w.bs4().set_bit());
        done
    }
}

fn within(ready: impl Fn() -> bool) -> Result<(), ErrorKind> {
    if (0..POLLS).any(|_| ready()) { Ok(()) } else { Err(ErrorKind::Other) }
}
