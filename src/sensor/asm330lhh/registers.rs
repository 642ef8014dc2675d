//! The registers of the ASM330LHH that the driver uses, and the values that it writes.
//!
//! Addresses and codes are those of ST's own drivers (asm330lhh-pid; st_asm330lhh for Linux). Filters, limits of the
//! self-test and times are those of the LSM6DSR's data sheet, a part of the same registers and the same identity: the tables
//! of DS13045 were not at hand, so compare them before you rely on a number.
//!
//! Both sensors deliver 208 samples a second, -3 dB at 23.1 Hz (gyro) and 20.8 Hz. What is aliased into the gyro's band is
//! above 185 Hz; the mean over 10 ms ([`crate::align`]) has a null at 100 Hz. At 104 samples a second the narrowest useful
//! filter has 19 Hz, and vibration of 85 Hz is aliased to 19.

use crate::sensor::spi::Setting;
use core::ops::RangeInclusive;

const fn set(address: u8, value: u8) -> Setting {
    Setting::new(0, address, value)
}

pub const SETTINGS: [Setting; 10] = [
    // An address counts on in a transfer; a reading is not changed between its bytes.
    set(CTRL3_C, 0x44),
    // The gyro's first filter is on, I2C is off.
    set(0x13, 0x06),
    set(CTRL5_C, 0),
    // The gyro's first filter has 23.1 Hz at 208 Hz.
    set(0x15, 0x06),
    // The accelerometer's second filter has a tenth of the output rate.
    set(0x17, 0x20),
    // As ST recommends (DEVICE_CONF); the upper bits as after a reset.
    set(0x18, 0xE2),
    // Time stamps.
    set(0x19, 0x20),
    // 208 Hz, 16 g, its second filter is on.
    set(CTRL1_XL, 0x56),
    // 208 Hz, 250 deg/s: a car turns at less than 100.
    set(CTRL2_G, 0x50),
    // Both at 208 Hz into the FIFO.
    set(0x09, 0x55),
];
/// Switches the FIFO on, last: it drops its oldest words. A time stamp with each sample, the temperature 52 times a second.
pub const FIFO: Setting = set(0x0A, 0x76);
/// For the self-test: 208 Hz, 4 g and 2000 deg/s.
pub const TEST: [Setting; 3] = [set(CTRL3_C, 0x44), set(CTRL1_XL, 0x58), set(CTRL2_G, 0x5C)];

pub const WHO_AM_I: u8 = 0x0F;
pub const CTRL1_XL: u8 = 0x10;
pub const CTRL2_G: u8 = 0x11;
pub const CTRL3_C: u8 = 0x12;
/// Takes [`DEFLECT`].
pub const CTRL5_C: u8 = 0x14;
/// First of the registers that hold the temperature, the rate and the acceleration.
pub const OUT_TEMP_L: u8 = 0x20;
pub const OUTX_L_G: u8 = 0x22;
pub const OUTX_L_A: u8 = 0x28;
/// Holds the number of words in the FIFO; its state follows.
pub const FIFO_STATUS1: u8 = 0x3A;
/// Deviation of the oscillator as the maker measured it, i8, 0.15 %.
pub const INTERNAL_FREQ_FINE: u8 = 0x63;
pub const FIFO_DATA_OUT_TAG: u8 = 0x78;

pub const IDENTITY: u8 = 0x6B;
/// Written to [`CTRL3_C`], resets the sensor; bit 0 falls when it is done.
pub const RESET: u8 = 0x05;
pub const RESETTING: u8 = 0x01;
/// Bits of the FIFO's state: number of words; words were lost since this was read.
pub const WAITING: u16 = 0x03FF;
pub const LOST: u16 = 0x0800;
/// Written to [`CTRL5_C`], deflects the masses of gyro and accelerometer.
pub const DEFLECT: u8 = 0x05;
/// What the deflection changes in a good part, counts: 150 to 700 deg/s, 40 to 1700 mg.
pub const RATE_CHANGE: RangeInclusive<i32> = 2_143..=10_000;
pub const FORCE_CHANGE: RangeInclusive<i32> = 328..=13_934;
