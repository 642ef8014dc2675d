//! No store: this part's flash takes words of 32 bytes, which `gyronet::store` does not write yet.
//! The image starts from its built-in values, says so, and refuses to store.

use crate::regions::FlashError;
use core::convert::Infallible;

/// What nobody has.
pub struct Flash(Infallible);

impl Flash {
    /// None.
    pub fn probe() -> Option<Self> {
        None
    }

    pub fn writable(&self) -> bool {
        match self.0 {}
    }

    pub fn slots_at_start(&self) -> [&'static [u8]; 2] {
        match self.0 {}
    }

    pub fn read(&self, _: u32, _: &mut [u8]) {
        match self.0 {}
    }

    pub fn erase(&self, _: u32) -> Result<(), FlashError> {
        match self.0 {}
    }

    pub fn write(&self, _: u32, _: &[u8]) -> Result<(), FlashError> {
        match self.0 {}
    }
}
