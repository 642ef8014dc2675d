//! A layout describes the positions of wheel speeds in a frame, and the protection of the frame.

use crate::can::bosch;
use crate::can::e2e::{Fault, Profile};
use crate::can::signal::BitField;
use crate::units::WheelSpeed;
use embedded_can::Id;

/// The position and scale of one wheel's speed in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelSignal {
    /// Index of the frame that carries the speed, in [`WheelSettings::frames`](super::WheelSettings::frames).
    pub frame: u8,
    /// Position of the raw value in the frame.
    pub field: BitField,
    /// Speed codes (2^-16 m/s) per LSB, times 2^16: see [`WheelSignal::per_bit_kmh`].
    pub factor_q16: i32,
    /// Speed at raw value zero.
    pub offset: WheelSpeed,
    /// Raw value that means "not valid".
    pub invalid: Option<u32>,
}

impl WheelSignal {
    /// Converts a DBC factor in km/h per LSB, below 1000, to [`WheelSignal::factor_q16`].
    #[must_use]
    pub const fn per_bit_kmh(factor: f64) -> i32 {
        (factor / 3.6 * 4_294_967_296.0) as i32
    }

    pub(super) fn speed(&self, wheel: usize, data: &[u8]) -> Result<WheelSpeed, WheelError> {
        let short = WheelError::Short(data.len());
        if self.invalid.is_some() && self.field.raw(data) == self.invalid {
            return Err(WheelError::Invalid { wheel });
        }
        let value = self.field.value(data).ok_or(short)?;
        // The product is at most 2^32 x 2^31.
        let code = ((value * i64::from(self.factor_q16)) >> 16) + i64::from(self.offset.0);
        i32::try_from(code).map(WheelSpeed).map_err(|_| WheelError::Invalid { wheel })
    }
}

/// The protection of a wheel frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Checksum {
    /// The frame is not protected.
    None,
    /// SAE J1850 CRC in one byte, over all other bytes in order.
    J1850 {
        /// Index of the checksum byte.
        at: usize,
    },
    /// Exclusive or of all other bytes, in one byte.
    Xor {
        /// Index of the checksum byte.
        at: usize,
    },
    /// Sum of all other bytes modulo 256, in one byte.
    Sum {
        /// Index of the checksum byte.
        at: usize,
    },
    /// AUTOSAR E2E; the counter of the profile is used.
    E2e(Profile),
}

/// One frame that carries wheel speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelFrame {
    /// Identifier of the frame.
    #[cfg_attr(feature = "serde", serde(with = "stored_id"))]
    pub id: Id,
    /// Message counter of up to 8 bits that cycles through all values, if there is one.
    pub counter: Option<BitField>,
    /// Protection of the frame.
    pub checksum: Checksum,
}

/// These functions store an identifier as a number; bit 31 marks an identifier of 29 bits.
#[cfg(feature = "serde")]
mod stored_id {
    use embedded_can::{ExtendedId, Id, StandardId};
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    const EXTENDED: u32 = 1 << 31;

    pub fn serialize<S: Serializer>(id: &Id, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(match id {
            Id::Standard(id) => id.as_raw().into(),
            Id::Extended(id) => id.as_raw() | EXTENDED,
        })
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Id, D::Error> {
        let raw = u32::deserialize(deserializer)?;
        let id = if raw & EXTENDED != 0 {
            ExtendedId::new(raw & !EXTENDED).map(Id::Extended)
        } else {
            u16::try_from(raw).ok().and_then(StandardId::new).map(Id::Standard)
        };
        id.ok_or_else(|| D::Error::custom("no identifier"))
    }
}

/// The reason why a frame gives no wheel speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WheelError {
    /// The frame has too few bytes.
    #[error("wheel frame of {0} bytes is too short")]
    Short(usize),
    /// The checksum is wrong.
    #[error("wheel frame has a wrong checksum")]
    Checksum,
    /// The E2E check failed.
    #[error("wheel frame: {0}")]
    E2e(Fault),
    /// The counter equals the previous one: an old frame.
    #[error("wheel frame is repeated")]
    Repeated,
    /// A wheel's speed is marked as not valid, or is out of range.
    #[error("wheel {wheel}: speed is not valid")]
    Invalid {
        /// Index of the wheel.
        wheel: usize,
    },
}

impl WheelFrame {
    /// Returns a mask of the bits that the protection uses.
    pub(super) fn protected_mask(&self) -> u64 {
        match self.checksum {
            Checksum::None => 0,
            // At most 7: the settings are checked.
            Checksum::J1850 { at } | Checksum::Xor { at } | Checksum::Sum { at } => 0xFF << (8 * at.min(7)),
            Checksum::E2e(profile) => profile.header_mask(),
        }
    }

    /// Returns the number of values of the frame's counter.
    pub(super) fn counters(&self) -> u16 {
        match (self.checksum, self.counter) {
            (Checksum::E2e(profile), _) => profile.counters(),
            (_, Some(field)) => 1 << field.bits(),
            (_, None) => 1,
        }
    }

    /// Checks the protection of a frame, and returns its counter if it has one.
    pub(super) fn check(&self, data: &[u8]) -> Result<Option<u8>, WheelError> {
        let short = WheelError::Short(data.len());
        let others =
            |at: usize| data.iter().enumerate().filter(move |(k, _)| *k != at).map(|(_, byte)| *byte);
        let (at, computed) = match self.checksum {
            Checksum::E2e(profile) => return profile.check(data).map(Some).map_err(WheelError::E2e),
            Checksum::None => return self.counter(data),
            Checksum::Xor { at } => (at, others(at).fold(0, |sum, byte| sum ^ byte)),
            Checksum::Sum { at } => (at, others(at).fold(0u8, u8::wrapping_add)),
            Checksum::J1850 { at } => {
                let mut digest = bosch::CRC.digest();
                others(at).for_each(|byte| digest.update(&[byte]));
                (at, digest.finalize())
            }
        };
        if *data.get(at).ok_or(short)? != computed {
            return Err(WheelError::Checksum);
        }
        self.counter(data)
    }

    fn counter(&self, data: &[u8]) -> Result<Option<u8>, WheelError> {
        let Some(field) = self.counter else { return Ok(None) };
        // At most 8 bits: the settings are checked.
        field.raw(data).map(|raw| Some(raw as u8)).ok_or(WheelError::Short(data.len()))
    }
}
