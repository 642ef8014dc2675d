//! A simulated SPI bus for the drivers of the parts on it.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use gyronet::sensor::spi::READ;
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// A part of one die or two.
pub trait Part {
    /// Bytes that a die sends before those of its registers.
    fn dummies(_die: usize) -> usize {
        0
    }

    fn write(&mut self, die: usize, address: u8, value: u8);

    fn read(&mut self, die: usize, address: u8, to: &mut [u8]);
}

/// The chip select of a die. Who holds the part can change it while the driver owns this.
pub struct Select<P>(pub Rc<RefCell<P>>, pub usize);

impl<P> ErrorType for Select<P> {
    type Error = Infallible;
}

impl<P: Part> SpiDevice for Select<P> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let (mut part, die) = (self.0.borrow_mut(), self.1);
        match operations {
            [Operation::Write([address, value])] => part.write(die, *address, *value),
            [Operation::Write([address, dummies @ ..]), Operation::Read(to)] => {
                assert!(*address >= READ && dummies.len() == P::dummies(die));
                part.read(die, address & !READ, to);
            }
            other => panic!("{other:?}"),
        }
        Ok(())
    }
}

pub struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _ns: u32) {}
}
