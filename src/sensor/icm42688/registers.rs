//! These are the registers of the ICM-42688-P that the driver uses, and the values that it writes.

/// A register: its bank and its address in the bank.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Register {
    /// Bank, 0 to 4.
    pub bank: u8,
    /// Address, 0x00 to 0x7F.
    pub address: u8,
}

/// The value that a register of the configuration must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Setting {
    /// Register to write.
    pub register: Register,
    /// Bits that are written; the other bits keep their reset values.
    pub mask: u8,
    /// Value of these bits.
    pub value: u8,
}

const fn bank0(address: u8) -> Register {
    Register { bank: 0, address }
}

/// Bit 7 of an address marks a read.
pub const READ: u8 = 0x80;

/// Bit 0 resets the sensor.
pub const DEVICE_CONFIG: Register = bank0(0x11);
/// Sets how the FIFO treats an overflow.
pub const FIFO_CONFIG: Register = bank0(0x16);
/// Holds the high byte of the number of bytes in the FIFO; the low byte follows.
pub const FIFO_COUNTH: Register = bank0(0x2E);
/// Reads from the front of the FIFO.
pub const FIFO_DATA: Register = bank0(0x30);
/// Bit 1 empties the FIFO.
pub const SIGNAL_PATH_RESET: Register = bank0(0x4B);
/// Sets the byte order and the unit of the FIFO count.
pub const INTF_CONFIG0: Register = bank0(0x4C);
/// Sets the clock and AFSR.
pub const INTF_CONFIG1: Register = bank0(0x4D);
/// Switches the sensors on.
pub const PWR_MGMT0: Register = bank0(0x4E);
/// Sets the gyro's range and rate.
pub const GYRO_CONFIG0: Register = bank0(0x4F);
/// Sets the accelerometer's range and rate.
pub const ACCEL_CONFIG0: Register = bank0(0x50);
/// Sets the order of the gyro's last filter.
pub const GYRO_CONFIG1: Register = bank0(0x51);
/// Sets the bandwidth of the last filters: accelerometer in the high nibble, gyro in the low one.
pub const GYRO_ACCEL_CONFIG0: Register = bank0(0x52);
/// Sets the order of the accelerometer's last filter.
pub const ACCEL_CONFIG1: Register = bank0(0x53);
/// Selects the data in the FIFO packets.
pub const FIFO_CONFIG1: Register = bank0(0x5F);
/// Reads as [`IDENTITY`].
pub const WHO_AM_I: Register = bank0(0x75);
/// Selects the bank; this register exists in every bank.
pub const BANK_SEL: u8 = 0x76;
/// Switches the gyro's anti-alias filter.
pub const GYRO_CONFIG_STATIC2: Register = Register { bank: 1, address: 0x0B };
/// Holds DELT of the gyro's anti-alias filter.
pub const GYRO_CONFIG_STATIC3: Register = Register { bank: 1, address: 0x0C };
/// Holds the low byte of DELTSQR of the gyro's anti-alias filter.
pub const GYRO_CONFIG_STATIC4: Register = Register { bank: 1, address: 0x0D };
/// Holds BITSHIFT of the gyro's anti-alias filter in the high nibble, DELTSQR's high bits in the low one.
pub const GYRO_CONFIG_STATIC5: Register = Register { bank: 1, address: 0x0E };
/// Holds DELT of the accelerometer's anti-alias filter in bits 6-1; bit 0 switches it off.
pub const ACCEL_CONFIG_STATIC2: Register = Register { bank: 2, address: 0x03 };
/// Holds the low byte of DELTSQR of the accelerometer's anti-alias filter.
pub const ACCEL_CONFIG_STATIC3: Register = Register { bank: 2, address: 0x04 };
/// Holds BITSHIFT and the high bits of DELTSQR of the accelerometer's anti-alias filter.
pub const ACCEL_CONFIG_STATIC4: Register = Register { bank: 2, address: 0x05 };

/// Value of [`WHO_AM_I`].
pub const IDENTITY: u8 = 0x47;
/// Written to [`DEVICE_CONFIG`], resets the sensor.
pub const RESET: u8 = 0x01;
/// Written to [`SIGNAL_PATH_RESET`], empties the FIFO.
pub const FIFO_FLUSH: u8 = 0x02;
/// Written to [`FIFO_CONFIG`], lets a full FIFO drop its oldest packets.
pub const FIFO_STREAM: u8 = 0x40;
/// Written to [`INTF_CONFIG0`], selects a count in bytes and big-endian order, as after a reset.
pub const BIG_ENDIAN: u8 = 0x30;
/// Written to [`INTF_CONFIG1`], switches AFSR off (bits 7-6 = 01). With AFSR on, the gyro repeats samples for a
/// millisecond or two above about 100 deg/s.
pub const AFSR_OFF: u8 = 0x40;
/// Written to [`PWR_MGMT0`], switches gyro and accelerometer on in low-noise mode.
pub const LOW_NOISE: u8 = 0x0F;
/// Written to [`GYRO_CONFIG0`], sets the range of 250 deg/s. A car turns at less than 100 deg/s, so resolution
/// matters more than range.
pub const GYRO_250_DPS: u8 = 3 << 5;
/// Written to [`ACCEL_CONFIG0`], sets the range of 16 g.
pub const ACCEL_16_G: u8 = 0 << 5;
/// Written to [`GYRO_CONFIG1`], sets the third order (GYRO_UI_FILT_ORD, bits 3-2).
pub const GYRO_THIRD_ORDER: u8 = 2 << 2;
/// Written to [`ACCEL_CONFIG1`], sets the third order (ACCEL_UI_FILT_ORD, bits 4-3).
pub const ACCEL_THIRD_ORDER: u8 = 2 << 3;
/// Written to [`FIFO_CONFIG1`], puts temperature, gyro and accelerometer into the FIFO, with readings of 20 bits.
pub const FIFO_20_BIT: u8 = 0x17;

/// Settings of the anti-alias filter for 258 Hz, from the data sheet's table of bandwidths.
pub mod aaf_258_hz {
    /// Value for [`super::GYRO_CONFIG_STATIC3`].
    pub const DELT: u8 = 6;
    /// Square of `DELT`, for the next two registers.
    pub const DELTSQR: u16 = 36;
    /// Value for the high nibble of [`super::GYRO_CONFIG_STATIC5`].
    pub const BITSHIFT: u8 = 10;
}
