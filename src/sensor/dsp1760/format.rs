//! A data message has one of three layouts, which its fourth byte announces; some fields exist only in some of them.

/// Every data message begins with these bytes; the format byte follows.
pub(super) const PREFIX: [u8; 3] = [0xFE, 0x81, 0xFF];

/// Names the layout of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Format {
    /// The message has no time stamp.
    A,
    /// The message has a time stamp.
    B,
    /// The message has one of four slow readings in turn.
    C,
}

impl Format {
    /// Returns the format that the first four bytes announce.
    #[must_use]
    pub const fn of(header: [u8; 4]) -> Option<Self> {
        match header {
            [0xFE, 0x81, 0xFF, 0x55] => Some(Self::A),
            [0xFE, 0x81, 0xFF, 0x56] => Some(Self::B),
            [0xFE, 0x81, 0xFF, 0x57] => Some(Self::C),
            _ => None,
        }
    }

    /// Returns the number of bytes of a whole message.
    #[must_use]
    pub const fn length(self) -> usize {
        match self {
            Self::A => 36,
            Self::B => 40,
            Self::C => 38,
        }
    }

    pub(super) const fn header_byte(self) -> u8 {
        match self {
            Self::A => 0x55,
            Self::B => 0x56,
            Self::C => 0x57,
        }
    }
}

/// Marks the good readings, one bit each; bits 3 and 7 are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity(pub u8);

impl Validity {
    /// All three gyro axes are good.
    pub const GYRO: Self = Self(0x07);
    /// All gyro and accelerometer axes are good.
    pub const ALL: Self = Self(0x77);

    /// Returns whether the gyro about `axis` (0 to 2) is good: the part drops the bit in saturation.
    #[must_use]
    pub const fn gyro(self, axis: usize) -> bool {
        axis < 3 && self.0 & 1 << axis != 0
    }

    /// Returns whether the accelerometer along `axis` (0 to 2) is good.
    #[must_use]
    pub const fn accelerometer(self, axis: usize) -> bool {
        axis < 3 && self.0 & 0x10 << axis != 0
    }
}

/// Holds the fields that only some formats have.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extra {
    /// Format A has a temperature, in the unit that the part is set to.
    Temperature(i16),
    /// Format B has a time stamp and a temperature.
    Timed {
        /// Time, microseconds; it wraps.
        time: u32,
        /// Temperature, in the unit that the part is set to.
        temperature: i16,
    },
    /// Format C has a temperature or the magnetic field x, y, z, by sequence number modulo 4.
    Slow(f32),
}
