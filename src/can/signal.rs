//! A bit field describes the position of a value in a frame, as in a DBC file.

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ByteOrder {
    /// Little-endian (DBC `@1`): the start bit is the lowest bit.
    Intel,
    /// Big-endian (DBC `@0`): the start bit is the highest bit, counted as `8 * byte + bit`.
    Motorola,
}

/// The error for a bit field that does not lie inside eight bytes, or whose length is not 1 to 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{} bits from bit {} do not lie inside a frame", .len, .start)]
pub struct OutsideFrame {
    pub start: u8,
    pub len: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(try_from = "Place", into = "Place")]
pub struct BitField {
    /// Number of bits below the value when the frame is read in its byte order.
    shift: u8,
    len: u8,
    order: ByteOrder,
    signed: bool,
    /// Shortest frame that contains the value, bytes.
    bytes: u8,
}

impl BitField {
    /// Creates a field from start bit and length, as in a DBC file.
    pub const fn new(start: u8, len: u8, order: ByteOrder, signed: bool) -> Result<Self, OutsideFrame> {
        let outside = Err(OutsideFrame { start, len });
        if start > 63 || len == 0 || len > 32 {
            return outside;
        }
        // Number of bits before the value when the frame is read in its byte order.
        let before = match order {
            ByteOrder::Intel => start,
            ByteOrder::Motorola => start / 8 * 8 + 7 - start % 8,
        };
        let end = before + len;
        if end > 64 {
            return outside;
        }
        let shift = match order {
            ByteOrder::Intel => before,
            ByteOrder::Motorola => 64 - end,
        };
        Ok(Self { shift, len, order, signed, bytes: end.div_ceil(8) })
    }

    pub const fn start(&self) -> u8 {
        match self.order {
            ByteOrder::Intel => self.shift,
            ByteOrder::Motorola => {
                let before = 64 - self.shift - self.len;
                before / 8 * 8 + 7 - before % 8
            }
        }
    }

    pub const fn order(&self) -> ByteOrder {
        self.order
    }

    pub const fn is_signed(&self) -> bool {
        self.signed
    }

    /// Returns a mask of the value's bits; bit `8 * byte + bit` of the frame is the same bit of the mask.
    pub const fn mask(&self) -> u64 {
        let mask = ((1 << self.len) - 1) << self.shift;
        match self.order {
            ByteOrder::Intel => mask,
            ByteOrder::Motorola => u64::swap_bytes(mask),
        }
    }

    /// Returns the number of bits of the value, 1 to 32.
    pub const fn bits(&self) -> u8 {
        self.len
    }

    /// Returns the raw bits, without sign extension; `None` if the frame is too short.
    pub fn raw(&self, data: &[u8]) -> Option<u32> {
        if data.len() < usize::from(self.bytes) {
            return None;
        }
        let bytes = match data.first_chunk() {
            Some(bytes) => *bytes,
            None => {
                let mut bytes = [0; 8];
                bytes.iter_mut().zip(data).for_each(|(byte, value)| *byte = *value);
                bytes
            }
        };
        let word = match self.order {
            ByteOrder::Intel => u64::from_le_bytes(bytes),
            ByteOrder::Motorola => u64::from_be_bytes(bytes),
        };
        Some((word >> self.shift & ((1 << self.len) - 1)) as u32)
    }

    /// Returns the value, sign-extended if the field is signed; `None` if the frame is too short.
    pub fn value(&self, data: &[u8]) -> Option<i64> {
        self.raw(data).map(|raw| self.extended(raw))
    }

    /// Returns the value of raw bits, sign-extended if the field is signed.
    pub(super) fn extended(&self, raw: u32) -> i64 {
        let raw = i64::from(raw);
        let negative = self.signed && raw >> (self.len - 1) & 1 == 1;
        if negative { raw - (1 << self.len) } else { raw }
    }
}

/// The stored form of a field: the numbers of a DBC file, which are checked on deserialization.
#[derive(serde::Serialize, serde::Deserialize)]
struct Place {
    start: u8,
    bits: u8,
    order: ByteOrder,
    signed: bool,
}

impl From<BitField> for Place {
    fn from(field: BitField) -> Self {
        Self { start: field.start(), bits: field.len, order: field.order, signed: field.signed }
    }
}

impl TryFrom<Place> for BitField {
    type Error = OutsideFrame;

    fn try_from(Place { start, bits, order, signed }: Place) -> Result<Self, OutsideFrame> {
        Self::new(start, bits, order, signed)
    }
}
