//! The wheel settings are a stored record, so that another vehicle needs new settings instead of a new image.

use super::error::FieldError;
use super::record::Record;
use crate::can::wheel::{WheelReceiver, WheelSettings};

impl Record for WheelSettings {
    const KEY: u8 = 4;
    const VERSION: u8 = 2;

    fn check(&self) -> Result<(), FieldError> {
        WheelReceiver::new(*self).map(drop).map_err(FieldError::Wheels)
    }
}
