//! No SPI: nothing drives it on this part yet.

use core::convert::Infallible;
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};

/// What nobody has.
#[derive(Debug, Clone, Copy)]
pub struct Spi(Infallible);

impl ErrorType for Spi {
    type Error = ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        match self.0 {}
    }
}
