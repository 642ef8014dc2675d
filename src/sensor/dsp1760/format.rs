//! A data message has one of two formats, selected by its fourth byte. The gyro's third one (57, with slow readings) is not
//! read.

/// First bytes of every data message; the format byte follows.
pub(super) const PREFIX: [u8; 3] = [0xFE, 0x81, 0xFF];

/// The format of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Format {
    /// Message without a time stamp.
    A,
    /// Message with a time stamp.
    B,
}

impl Format {
    /// Returns the format that the first four bytes select.
    pub const fn of(header: [u8; 4]) -> Option<Self> {
        match header {
            [0xFE, 0x81, 0xFF, 0x55] => Some(Self::A),
            [0xFE, 0x81, 0xFF, 0x56] => Some(Self::B),
            _ => None,
        }
    }

    /// Returns the length of a whole message, bytes.
    pub const fn length(self) -> usize {
        match self {
            Self::A => 36,
            Self::B => 40,
        }
    }

    pub(super) const fn header_byte(self) -> u8 {
        match self {
            Self::A => 0x55,
            Self::B => 0x56,
        }
    }
}

/// The status bits of the readings, 1 for good; bits 3 and 7 are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity(pub u8);

impl Validity {
    /// Bits of the three gyro axes.
    pub const GYRO: Self = Self(0x07);
    /// Bits of all gyro and accelerometer axes.
    pub const ALL: Self = Self(0x77);

    /// Returns whether the gyro about `axis` (0 to 2) is good; the bit is 0 when the gyro is saturated.
    pub const fn gyro(self, axis: usize) -> bool {
        axis < 3 && self.0 & 1 << axis != 0
    }

    /// Returns whether the accelerometer along `axis` (0 to 2) is good.
    pub const fn accelerometer(self, axis: usize) -> bool {
        axis < 3 && self.0 & 0x10 << axis != 0
    }
}

/// The fields in which the formats differ.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extra {
    /// Temperature of format A, deg C.
    Temperature(i16),
    /// Time stamp and temperature of format B.
    Timed {
        /// Time, microseconds; it wraps.
        time: u32,
        /// Temperature, deg C.
        temperature: i16,
    },
}
