//! No store: this part's flash takes words of 32 bytes, which `gyronet::store` does not write yet.
//! The image starts from its built-in values, says so, and refuses to store.

use core::convert::Infallible;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use gyronet::service::MappedSlots;
use gyronet::store::layout::{RECORD_SECTOR, SLOT_SIZE};

/// What nobody has.
pub struct Flash(Infallible);

/// Never comes.
#[derive(Debug, Clone, Copy)]
pub struct FlashError(Infallible);

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self.0 {}
    }
}

impl Flash {
    /// None.
    pub fn probe() -> Option<Self> {
        None
    }

    /// Of none.
    pub fn writable(&self) -> bool {
        match self.0 {}
    }

    /// Of none.
    pub fn slots_at_start(&self) -> [&'static [u8]; 2] {
        match self.0 {}
    }
}

macro_rules! region {
    ($name:ident, $sector:expr, $doc:literal) => {
        #[doc = $doc]
        pub struct $name(pub &'static Flash);

        impl ErrorType for $name {
            type Error = FlashError;
        }

        impl ReadNorFlash for $name {
            const READ_SIZE: usize = 1;

            fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), FlashError> {
                match self.0.0 {}
            }

            fn capacity(&self) -> usize {
                match self.0.0 {}
            }
        }

        impl NorFlash for $name {
            const WRITE_SIZE: usize = 4;
            const ERASE_SIZE: usize = $sector;

            fn erase(&mut self, _: u32, _: u32) -> Result<(), FlashError> {
                match self.0.0 {}
            }

            fn write(&mut self, _: u32, _: &[u8]) -> Result<(), FlashError> {
                match self.0.0 {}
            }
        }
    };
}

region!(Records, RECORD_SECTOR, "Where records would be.");
region!(Slots, SLOT_SIZE, "Where weight slots would be.");

impl MappedSlots for Slots {
    fn slots(&self) -> [&[u8]; 2] {
        match self.0.0 {}
    }
}
