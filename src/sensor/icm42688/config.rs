//! Converts the configuration of an ICM-42688-P to register values.
//!
//! The sensor's filters run at 400 Hz or more, and at an output rate of 100 Hz every fourth value is output
//! (DS-000347, 5.5). What the last filter passes above 50 Hz is therefore aliased, and vibration near 100 Hz appears
//! as rotation. After a reset that filter has a bandwidth of 92.3 Hz. The driver selects its third order, and by
//! default [`Bandwidth::Sixteenth`]. At 100 Hz:
//!
//! | bandwidth | code | -3 dB, Hz | group delay, ms | at 50 Hz, dB | at 100 Hz, dB |
//! |---|---|---|---|---|---|
//! | after a reset, second order | 1 | 92.3 | 5.1 | -0.4 | -3.8 |
//! | [`Bandwidth::Tenth`] | 4 | 39.2 | 11.4 | -7.2 | -24.4 |
//! | [`Bandwidth::Sixteenth`] | 5 | 24.3 | 16.5 | -18.9 | -36.9 |
//! | [`Bandwidth::Twentieth`] | 6 | 18.7 | 20.4 | -25.6 | -43.7 |
//! | [`Bandwidth::Fortieth`] | 7 | 10.1 | 35.2 | -41.7 | -59.7 |
//!
//! Bandwidth and group delay are from the data sheet (tables of 5.5). It gives no attenuation: the last two columns
//! are those of a Butterworth filter of that order and bandwidth. Vibration that would be aliased at 400 Hz first
//! passes the anti-alias filter (258 Hz) and the decimation filter (104.8 Hz).
//!
//! A mean of ten samples at 1 kHz would have a delay of only 4.5 ms and zeros at the frequencies that are aliased,
//! but would need ten times the SPI traffic and a decimator in the driver. At 100 Hz our filter leaves only 1.4 %.

use crate::sensor::spi::Setting;

/// The output rate of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OutputRate {
    /// 100 samples per second.
    #[default]
    Hz100,
    /// 1000 samples per second.
    Hz1000,
}

impl OutputRate {
    /// Returns the low nibble of the two configuration registers.
    const fn code(self) -> u8 {
        match self {
            Self::Hz1000 => 6,
            Self::Hz100 => 8,
        }
    }
}

/// The -3 dB point of the last filter of gyro and accelerometer, as a fraction of the filter's rate: the output rate,
/// but at least 400 Hz. Wider settings are not offered, because with them vibration is aliased at 100 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Bandwidth {
    /// 39.2 Hz at 100 Hz, 97.9 Hz at 1 kHz.
    Tenth,
    /// 24.3 Hz at 100 Hz, 60.8 Hz at 1 kHz.
    #[default]
    Sixteenth,
    /// 18.7 Hz at 100 Hz, 46.8 Hz at 1 kHz.
    Twentieth,
    /// 10.1 Hz at 100 Hz, 25.2 Hz at 1 kHz.
    Fortieth,
}

impl Bandwidth {
    /// Returns the value of either nibble of GYRO_ACCEL_CONFIG0.
    const fn code(self) -> u8 {
        match self {
            Self::Tenth => 4,
            Self::Sixteenth => 5,
            Self::Twentieth => 6,
            Self::Fortieth => 7,
        }
    }
}

/// The settings of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Icm42688Config {
    /// Samples per second.
    pub rate: OutputRate,
    /// Bandwidth of the last filter.
    pub bandwidth: Bandwidth,
}

impl Icm42688Config {
    /// Returns the register values in the order in which they are written: filters and ranges
    /// before gyro and accelerometer are switched on.
    pub const fn settings(&self) -> [Setting; SETTINGS] {
        const fn set(bank: u8, address: u8, mask: u8, value: u8) -> Setting {
            Setting { bank, address, mask, value }
        }
        let (rate, bandwidth) = (self.rate.code(), self.bandwidth.code());
        [
            // Counts in bytes and big-endian order, as after a reset.
            set(0, 0x4C, 0x70, 0x30),
            // AFSR off: with it on, the gyro repeats samples for a millisecond or two above about 100 deg/s.
            set(0, 0x4D, 0xC0, 0x40),
            // 250 deg/s: a car turns at less than 100, so resolution matters more than range. 16 g.
            set(0, 0x4F, 0xEF, 3 << 5 | rate),
            set(0, 0x50, 0xEF, rate),
            // The last filters: third order of the gyro, bandwidth of both, third order of the accelerometer.
            set(0, 0x51, 0x0C, 2 << 2),
            set(0, 0x52, 0xFF, bandwidth << 4 | bandwidth),
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
        ]
    }
}

/// Number of registers that are set, and checked one after the other.
pub const SETTINGS: usize = 17;
