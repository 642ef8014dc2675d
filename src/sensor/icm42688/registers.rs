//! These are the registers of the ICM-42688-P that the driver uses beside those of its configuration, all in bank 0.

/// Bit 0 resets the sensor.
pub const DEVICE_CONFIG: u8 = 0x11;
/// Holds the high byte of the number of bytes in the FIFO; the low byte follows.
pub const FIFO_COUNTH: u8 = 0x2E;
pub const FIFO_DATA: u8 = 0x30;
/// Bit 1 empties the FIFO.
pub const SIGNAL_PATH_RESET: u8 = 0x4B;
pub const WHO_AM_I: u8 = 0x75;
/// Selects the bank; this register exists in every bank.
pub const BANK_SEL: u8 = 0x76;

pub const IDENTITY: u8 = 0x47;
/// Written to [`DEVICE_CONFIG`], resets the sensor.
pub const RESET: u8 = 0x01;
/// Written to [`SIGNAL_PATH_RESET`], empties the FIFO.
pub const FIFO_FLUSH: u8 = 0x02;
