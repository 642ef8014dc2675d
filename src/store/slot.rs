//! The two places for weight files, and for firmware, in the flash.

use super::layout::{SLOT_SIZE, SLOTS};
use core::ops::Range;
use serde::{Deserialize, Serialize};

/// One of two slots: for GyroNet's weights, or for firmware ([`Slot::firmware`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Slot {
    /// Sector 10; firmware in sectors 8 and 9.
    A,
    /// Sector 11; firmware in sectors 6 and 7.
    B,
}

impl Slot {
    /// Both slots, in order.
    pub const ALL: [Self; 2] = [Self::A, Self::B];

    /// Returns the other slot.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }

    /// Returns the flash offset of the slot.
    pub const fn offset(self) -> u32 {
        SLOTS.start + self as u32 * SLOT_SIZE as u32
    }

    /// Returns the flash offsets of the slot: a whole sector.
    pub const fn range(self) -> Range<u32> {
        self.offset()..self.offset() + SLOT_SIZE as u32
    }

    /// Returns this slot's element of a pair (A, B).
    pub(crate) const fn of<T: Copy>(self, pair: [T; 2]) -> T {
        pair[self as usize]
    }
}

impl core::fmt::Display for Slot {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(Self::of(*self, ["A", "B"]))
    }
}
