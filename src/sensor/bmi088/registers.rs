//! The registers of the BMI088 that the driver uses, and the values that it writes (BST-BMI088-DS001). Only code was a
//! witness that bit 7 of the gyro's bandwidth reads as 1 (PX4, ArduPilot).
//!
//! Both dies deliver 200 samples a second with the narrowest filter for it, -3 dB at 23 Hz (gyro) and 20 Hz. Vibration
//! below 177 Hz is not aliased into the gyro's band; the mean over 10 ms ([`crate::align`]) has a null at 100 Hz.

use crate::sensor::spi::Setting;

/// The two dies, as the banks of a setting and of an error.
pub const ACCELEROMETER: u8 = 0;
pub const GYRO: u8 = 1;
pub const IDENTITIES: [u8; 2] = [0x1E, 0x0F];

const fn acc(address: u8, value: u8) -> Setting {
    Setting::new(ACCELEROMETER, address, value)
}

const fn gyro(address: u8, value: u8) -> Setting {
    Setting::new(GYRO, address, value)
}

/// Switches the accelerometer on, which starts suspended and off.
pub const POWER: [Setting; 2] = [acc(0x7C, 0), acc(0x7D, 4)];
/// For the accelerometer's self-test: 24 g and 1.6 kHz. The data sheet prints A7 beside bits that make AC.
pub const TEST: [Setting; 2] = [acc(0x41, 3), acc(0x40, 0xAC)];
pub const SETTINGS: [Setting; 10] = [
    POWER[0],
    POWER[1],
    // 200 Hz, four times oversampled; 12 g, which no pothole reaches.
    acc(0x40, 0x89),
    acc(0x41, 2),
    // FIFO of accelerations, where the oldest is dropped.
    acc(0x48, 0x02),
    acc(0x49, 0x50),
    // 250 deg/s: a car turns at less than 100. 200 Hz with 23 Hz. Normal power.
    gyro(0x0F, 3),
    gyro(0x10, 0x84),
    gyro(0x11, 0),
    gyro(GYRO_FIFO_CONFIG_1, STOP_WHEN_FULL),
];
/// Nominal period of both dies, microseconds, and in counts of the accelerometer's time.
pub const PERIOD_US: u64 = 5_000;
pub const PERIOD_COUNTS: u32 = 128;

pub const CHIP_ID: u8 = 0x00;
pub const ACC_DATA: u8 = 0x12;
/// First of the registers that hold the accelerometer's state.
pub const ACC_SENSORTIME: u8 = 0x18;
pub const ACC_FIFO_DATA: u8 = 0x26;
pub const ACC_SELF_TEST: u8 = 0x6D;
/// Takes [`RESET`] and [`FIFO_FLUSH`].
pub const ACC_SOFTRESET: u8 = 0x7E;
pub const GYRO_FIFO_STATUS: u8 = 0x0E;
pub const GYRO_SOFTRESET: u8 = 0x14;
pub const GYRO_SELF_TEST: u8 = 0x3C;
/// A write empties the gyro's FIFO.
pub const GYRO_FIFO_CONFIG_1: u8 = 0x3E;
pub const GYRO_FIFO_DATA: u8 = 0x3F;

pub const RESET: u8 = 0xB6;
pub const FIFO_FLUSH: u8 = 0xB0;
pub const OVERRUN: u8 = 0x80;
pub const STOP_WHEN_FULL: u8 = 0x40;
/// Bits of the gyro's self-test: begin, ended, failed, drive in order.
pub const TEST_BEGIN: u8 = 0x01;
pub const TEST_READY: u8 = 0x02;
pub const TEST_FAILED: u8 = 0x04;
pub const RATE_OK: u8 = 0x10;
/// Deflect the masses one way and the other.
pub const DEFLECTIONS: [u8; 2] = [0x0D, 0x09];
/// Least difference between both, x, y, z, in counts at 24 g: 1 g, 1 g, 0.5 g.
pub const LEAST_DEFLECTION: [i32; 3] = [1_366, 1_366, 683];
