//! How an ICM-42688-P is set, and what its registers hold then.

use super::packet::Resolution;
use super::registers::{self as reg, Register, Setting, aaf_258_hz};

/// Samples per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OutputRate {
    /// 100.
    #[default]
    Hz100,
    /// 1000.
    Hz1000,
}

impl OutputRate {
    /// Low nibble of the two configuration registers.
    const fn code(self) -> u8 {
        match self {
            Self::Hz1000 => 6,
            Self::Hz100 => 8,
        }
    }
}

/// How the part is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Icm42688Config {
    /// Samples per second.
    pub rate: OutputRate,
    /// Of the FIFO's packets.
    pub resolution: Resolution,
}

impl Icm42688Config {
    /// What the registers must hold, in the order in which they are written: filters and ranges
    /// before the sensors are switched on.
    #[must_use]
    pub const fn settings(&self) -> [Setting; SETTINGS] {
        const fn set(register: Register, mask: u8, value: u8) -> Setting {
            Setting { register, mask, value }
        }
        let [square_high, square_low] = aaf_258_hz::DELTSQR.to_be_bytes();
        let shift = aaf_258_hz::BITSHIFT << 4 | square_high;
        let content = match self.resolution {
            Resolution::Bits16 => reg::FIFO_16_BIT,
            Resolution::Bits20 => reg::FIFO_20_BIT,
        };
        [
            set(reg::INTF_CONFIG0, 0x70, reg::BIG_ENDIAN),
            set(reg::INTF_CONFIG1, 0xC0, reg::AFSR_OFF),
            set(reg::GYRO_CONFIG0, 0xEF, reg::GYRO_250_DPS | self.rate.code()),
            set(reg::ACCEL_CONFIG0, 0xEF, reg::ACCEL_16_G | self.rate.code()),
            set(reg::GYRO_CONFIG_STATIC2, 0x03, 0),
            set(reg::GYRO_CONFIG_STATIC3, 0x3F, aaf_258_hz::DELT),
            set(reg::GYRO_CONFIG_STATIC4, 0xFF, square_low),
            set(reg::GYRO_CONFIG_STATIC5, 0xFF, shift),
            set(reg::ACCEL_CONFIG_STATIC2, 0x7F, aaf_258_hz::DELT << 1),
            set(reg::ACCEL_CONFIG_STATIC3, 0xFF, square_low),
            set(reg::ACCEL_CONFIG_STATIC4, 0xFF, shift),
            set(reg::FIFO_CONFIG1, 0x17, content),
            set(reg::FIFO_CONFIG, 0xC0, reg::FIFO_STREAM),
            set(reg::PWR_MGMT0, 0x2F, reg::LOW_NOISE),
        ]
    }
}

/// Registers that are set, and checked in turn.
pub const SETTINGS: usize = 14;
