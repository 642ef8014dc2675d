//! The record of the wheel settings makes a vehicle that is not the built-in one a matter of configuration, not of a
//! new image.

use super::error::FieldError;
use super::record::Record;
use crate::can::wheel::{WheelReceiver, WheelSettings};

impl Record for WheelSettings {
    const KEY: u8 = 4;
    const VERSION: u8 = 1;

    fn check(&self) -> Result<(), FieldError> {
        WheelReceiver::new(*self).map(drop).map_err(FieldError::Wheels)
    }
}
