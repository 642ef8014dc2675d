//! The registers of the ICM-42688-P that the driver uses, and the values that it writes.
//!
//! The sensor's filters run at 400 Hz or more, and at 100 Hz every fourth value is output (DS-000347, 5.5): what the
//! last filter passes above 50 Hz is aliased, and vibration near 100 Hz appears as rotation. The driver selects its
//! third order with a sixteenth of its rate (code 5): 24.3 Hz, a group delay of 16.5 ms, by a Butterworth filter 18.9
//! dB off at 50 Hz and 36.9 dB at 100 Hz (3.8 dB after a reset). What would be aliased at 400 Hz first passes the
//! anti-alias filter (258 Hz) and the decimation filter (104.8 Hz).
//!
//! A mean of ten samples at 1 kHz would have a delay of only 4.5 ms and zeros at the frequencies that are aliased, but
//! need ten times the SPI traffic. At 100 Hz our filter leaves only 1.4 %.

use crate::sensor::spi::Setting;

const fn set(bank: u8, address: u8, mask: u8, value: u8) -> Setting {
    Setting { bank, address, mask, value }
}

/// The low nibble of the two configuration registers: 100 samples per second.
const RATE: u8 = 8;

/// The registers in the order of writing: filters and ranges before gyro and accelerometer are on.
pub const SETTINGS: [Setting; 17] = [
    // Counts in bytes and big-endian order, as after a reset.
    set(0, 0x4C, 0x70, 0x30),
    // AFSR off: with it on, the gyro repeats samples for a millisecond or two above about 100 deg/s.
    set(0, 0x4D, 0xC0, 0x40),
    // 250 deg/s: a car turns at less than 100, so resolution matters more than range. 16 g.
    set(0, 0x4F, 0xEF, 3 << 5 | RATE),
    set(0, 0x50, 0xEF, RATE),
    // The last filters: third order of the gyro, bandwidth of both, third order of the accelerometer.
    set(0, 0x51, 0x0C, 2 << 2),
    set(0, 0x52, 0xFF, 5 << 4 | 5),
    set(0, 0x53, 0x18, 2 << 3),
    // The anti-alias filters are on, with 258 Hz: DELT 6, DELTSQR 36, BITSHIFT 10 by the data sheet's table.
    set(1, 0x0B, 0x03, 0),
    set(1, 0x0C, 0x3F, 6),
    set(1, 0x0D, 0xFF, 36),
    set(1, 0x0E, 0xFF, 10 << 4),
    set(2, 0x03, 0x7F, 6 << 1),
    set(2, 0x04, 0xFF, 36),
    set(2, 0x05, 0xFF, 10 << 4),
    // Temperature, gyro and accelerometer into the FIFO, with readings of 20 bits; a full one drops its oldest.
    set(0, 0x5F, 0x17, 0x17),
    set(0, 0x16, 0xC0, 0x40),
    // Both on, in low-noise mode.
    set(0, 0x4E, 0x2F, 0x0F),
];

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
