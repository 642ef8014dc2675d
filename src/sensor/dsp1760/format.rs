//! The three layouts of a data message, and what only some of them carry.

/// What every data message begins with; the format byte follows.
pub(super) const PREFIX: [u8; 3] = [0xFE, 0x81, 0xFF];

/// Layout of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Format {
    /// Without time stamp.
    A,
    /// With a time stamp.
    B,
    /// With one slow reading in turn.
    C,
}

impl Format {
    /// The format that the first four bytes announce.
    #[must_use]
    pub const fn of(header: [u8; 4]) -> Option<Self> {
        match header {
            [0xFE, 0x81, 0xFF, 0x55] => Some(Self::A),
            [0xFE, 0x81, 0xFF, 0x56] => Some(Self::B),
            [0xFE, 0x81, 0xFF, 0x57] => Some(Self::C),
            _ => None,
        }
    }

    /// Bytes of a whole message.
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

/// Which readings are good, one bit each; bits 3 and 7 are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity(pub u8);

impl Validity {
    /// All three gyro axes.
    pub const GYRO: Self = Self(0x07);
    /// All gyro and accelerometer axes.
    pub const ALL: Self = Self(0x77);

    /// Whether the gyro about `axis` (0 to 2) is good: the part drops the bit in saturation.
    #[must_use]
    pub const fn gyro(self, axis: usize) -> bool {
        axis < 3 && self.0 & 1 << axis != 0
    }

    /// Whether the accelerometer along `axis` (0 to 2) is good.
    #[must_use]
    pub const fn accelerometer(self, axis: usize) -> bool {
        axis < 3 && self.0 & 0x10 << axis != 0
    }
}

/// What only some formats carry.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extra {
    /// Format A: a temperature in the unit that the part is set to.
    Temperature(i16),
    /// Format B.
    Timed {
        /// Microseconds, wraps.
        time: u32,
        /// As in format A.
        temperature: i16,
    },
    /// Format C: temperature or magnetic field x, y, z by sequence number modulo 4.
    Slow(f32),
}
