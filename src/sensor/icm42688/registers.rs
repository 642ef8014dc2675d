//! The driver uses these registers of the ICM-42688-P, and writes these values to them.

/// A register: its bank and its address there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Register {
    /// 0 to 4.
    pub bank: u8,
    /// 0x00 to 0x7F.
    pub address: u8,
}

/// The content that a register of the configuration must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Setting {
    /// The register.
    pub register: Register,
    /// Its bits that are set; the others stay as they are after a reset.
    pub mask: u8,
    /// Their value.
    pub value: u8,
}

const fn bank0(address: u8) -> Register {
    Register { bank: 0, address }
}

/// Bit 7 of an address marks a read.
pub const READ: u8 = 0x80;

/// Bit 0 resets the part.
pub const DEVICE_CONFIG: Register = bank0(0x11);
/// The FIFO's treatment of an overflow.
pub const FIFO_CONFIG: Register = bank0(0x16);
/// Bytes in the FIFO, high byte; the low one follows.
pub const FIFO_COUNTH: Register = bank0(0x2E);
/// The FIFO's front.
pub const FIFO_DATA: Register = bank0(0x30);
/// Bit 1 empties the FIFO.
pub const SIGNAL_PATH_RESET: Register = bank0(0x4B);
/// Byte order, and unit of the FIFO count.
pub const INTF_CONFIG0: Register = bank0(0x4C);
/// Clock and AFSR.
pub const INTF_CONFIG1: Register = bank0(0x4D);
/// The sensors that are switched on.
pub const PWR_MGMT0: Register = bank0(0x4E);
/// Gyro range and rate.
pub const GYRO_CONFIG0: Register = bank0(0x4F);
/// Accelerometer range and rate.
pub const ACCEL_CONFIG0: Register = bank0(0x50);
/// Order of the gyro's last filter.
pub const GYRO_CONFIG1: Register = bank0(0x51);
/// Bandwidth of the last filters: accelerometer in the high nibble, gyro in the low one.
pub const GYRO_ACCEL_CONFIG0: Register = bank0(0x52);
/// Order of the accelerometer's last filter.
pub const ACCEL_CONFIG1: Register = bank0(0x53);
/// The data that go into the FIFO.
pub const FIFO_CONFIG1: Register = bank0(0x5F);
/// [`IDENTITY`].
pub const WHO_AM_I: Register = bank0(0x75);
/// The bank that is selected; in every bank.
pub const BANK_SEL: u8 = 0x76;
/// Gyro anti-alias filter: switches.
pub const GYRO_CONFIG_STATIC2: Register = Register { bank: 1, address: 0x0B };
/// Gyro anti-alias filter: DELT.
pub const GYRO_CONFIG_STATIC3: Register = Register { bank: 1, address: 0x0C };
/// Gyro anti-alias filter: DELTSQR, low byte.
pub const GYRO_CONFIG_STATIC4: Register = Register { bank: 1, address: 0x0D };
/// Gyro anti-alias filter: BITSHIFT in the high nibble, DELTSQR's high bits in the low one.
pub const GYRO_CONFIG_STATIC5: Register = Register { bank: 1, address: 0x0E };
/// Accelerometer anti-alias filter: DELT in bits 6-1, bit 0 switches it off.
pub const ACCEL_CONFIG_STATIC2: Register = Register { bank: 2, address: 0x03 };
/// Accelerometer anti-alias filter: DELTSQR, low byte.
pub const ACCEL_CONFIG_STATIC3: Register = Register { bank: 2, address: 0x04 };
/// Accelerometer anti-alias filter: BITSHIFT and DELTSQR's high bits.
pub const ACCEL_CONFIG_STATIC4: Register = Register { bank: 2, address: 0x05 };

/// The content that [`WHO_AM_I`] must have.
pub const IDENTITY: u8 = 0x47;
/// [`DEVICE_CONFIG`]: reset.
pub const RESET: u8 = 0x01;
/// [`SIGNAL_PATH_RESET`]: empty the FIFO.
pub const FIFO_FLUSH: u8 = 0x02;
/// [`FIFO_CONFIG`]: the oldest packets give way.
pub const FIFO_STREAM: u8 = 0x40;
/// [`INTF_CONFIG0`]: count in bytes, big-endian, as after a reset.
pub const BIG_ENDIAN: u8 = 0x30;
/// [`INTF_CONFIG1`]: bits 7-6 = 01 switch AFSR off. With AFSR on, the gyro repeats samples for
/// a millisecond or two above some 100 deg/s.
pub const AFSR_OFF: u8 = 0x40;
/// [`PWR_MGMT0`]: gyro and accelerometer in low-noise mode.
pub const LOW_NOISE: u8 = 0x0F;
/// [`GYRO_CONFIG0`]: 250 deg/s. A car turns at less than 100 deg/s, and finer steps are worth
/// more than range.
pub const GYRO_250_DPS: u8 = 3 << 5;
/// [`ACCEL_CONFIG0`]: 16 g.
pub const ACCEL_16_G: u8 = 0 << 5;
/// [`GYRO_CONFIG1`]: GYRO_UI_FILT_ORD, bits 3-2.
pub const GYRO_THIRD_ORDER: u8 = 2 << 2;
/// [`ACCEL_CONFIG1`]: ACCEL_UI_FILT_ORD, bits 4-3.
pub const ACCEL_THIRD_ORDER: u8 = 2 << 3;
/// [`FIFO_CONFIG1`]: temperature, gyro, accelerometer.
pub const FIFO_16_BIT: u8 = 0x07;
/// [`FIFO_CONFIG1`]: the same with 20 bits.
pub const FIFO_20_BIT: u8 = 0x17;

/// The anti-alias filter for 258 Hz: its three numbers, from the data sheet's table of bandwidths.
pub mod aaf_258_hz {
    /// The value for [`super::GYRO_CONFIG_STATIC3`].
    pub const DELT: u8 = 6;
    /// The square of it, for the two registers behind.
    pub const DELTSQR: u16 = 36;
    /// The value for the high nibble of [`super::GYRO_CONFIG_STATIC5`].
    pub const BITSHIFT: u8 = 10;
}
