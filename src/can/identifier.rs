//! Identifiers as numbers, without their length or with it, which bit 31 then is: 1 for 29 bits. Stored with it.

use embedded_can::{ExtendedId, Id, StandardId};
use serde::{Deserialize, Deserializer, Serializer, de::Error};

/// The bit of an identifier of 29 bits.
pub const EXTENDED: u32 = 1 << 31;

/// Returns the bits of an identifier.
pub fn raw(id: Id) -> u32 {
    packed(id) & !EXTENDED
}

/// Returns an identifier with its length.
#[inline]
pub fn packed(id: Id) -> u32 {
    match id {
        Id::Standard(id) => id.as_raw().into(),
        Id::Extended(id) => id.as_raw() | EXTENDED,
    }
}

/// Returns the identifier of a number with its length, if there is one.
pub fn unpacked(number: u32) -> Option<Id> {
    match number & EXTENDED {
        0 => StandardId::new(number.try_into().ok()?).map(Id::Standard),
        _ => ExtendedId::new(number & !EXTENDED).map(Id::Extended),
    }
}

pub(crate) fn serialize<S: Serializer>(id: &Id, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u32(packed(*id))
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Id, D::Error> {
    unpacked(u32::deserialize(deserializer)?).ok_or_else(|| D::Error::custom("no identifier"))
}
