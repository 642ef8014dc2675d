//! A bit field is the place of a value in a frame, as DBC files give it.

/// Order of a value's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ByteOrder {
    /// Little-endian (DBC `@1`): the start bit is the lowest bit.
    Intel,
    /// Big-endian (DBC `@0`): the start bit is the highest bit, counted as `8 * byte + bit`.
    Motorola,
}

/// The value does not lie inside eight bytes, or has no bits, or over 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{} bits from bit {} do not lie inside a frame", .len, .start)]
pub struct OutsideFrame {
    /// Start bit as given.
    pub start: u8,
    /// Length as given.
    pub len: u8,
}

/// Bits of a frame that are one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Place", into = "Place"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BitField {
    /// Bits to the right of the value, in the order of the bytes.
    shift: u8,
    len: u8,
    order: ByteOrder,
    signed: bool,
    /// Bytes that a frame needs.
    bytes: u8,
}

impl BitField {
    /// Makes a field from start bit and length, as a DBC file gives them.
    ///
    /// # Errors
    /// [`OutsideFrame`].
    pub const fn new(start: u8, len: u8, order: ByteOrder, signed: bool) -> Result<Self, OutsideFrame> {
        let outside = Err(OutsideFrame { start, len });
        if start > 63 || len == 0 || len > 32 {
            return outside;
        }
        // Bits before the value when the frame is read in its order.
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

    /// Returns the start bit, as a DBC file gives it.
    #[must_use]
    pub const fn start(&self) -> u8 {
        match self.order {
            ByteOrder::Intel => self.shift,
            ByteOrder::Motorola => {
                let before = 64 - self.shift - self.len;
                before / 8 * 8 + 7 - before % 8
            }
        }
    }

    /// Returns the order of the value's bytes.
    #[must_use]
    pub const fn order(&self) -> ByteOrder {
        self.order
    }

    /// Returns whether the value has a sign.
    #[must_use]
    pub const fn is_signed(&self) -> bool {
        self.signed
    }

    /// Returns the bits of the frame that the value takes: bit `8 * byte + bit` of the frame is that bit here.
    #[must_use]
    pub const fn mask(&self) -> u64 {
        let mask = ((1 << self.len) - 1) << self.shift;
        match self.order {
            ByteOrder::Intel => mask,
            ByteOrder::Motorola => u64::swap_bytes(mask),
        }
    }

    /// Returns the number of bits of the value, 1 to 32.
    #[must_use]
    pub const fn bits(&self) -> u8 {
        self.len
    }

    /// Returns the bits as they are; `None` when the frame is too short.
    #[must_use]
    pub fn raw(&self, data: &[u8]) -> Option<u32> {
        if data.len() < usize::from(self.bytes) {
            return None;
        }
        let mut bytes = [0; 8];
        for (byte, value) in bytes.iter_mut().zip(data) {
            *byte = *value;
        }
        let word = match self.order {
            ByteOrder::Intel => u64::from_le_bytes(bytes),
            ByteOrder::Motorola => u64::from_be_bytes(bytes),
        };
        Some((word >> self.shift & ((1 << self.len) - 1)) as u32)
    }

    /// Returns the value with its sign.
    #[must_use]
    pub fn value(&self, data: &[u8]) -> Option<i64> {
        let raw = i64::from(self.raw(data)?);
        let negative = self.signed && raw >> (self.len - 1) & 1 == 1;
        Some(if negative { raw - (1 << self.len) } else { raw })
    }
}

/// A field as it is stored: the numbers of a DBC file, which are checked when they are read.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Place {
    start: u8,
    bits: u8,
    order: ByteOrder,
    signed: bool,
}

#[cfg(feature = "serde")]
impl From<BitField> for Place {
    fn from(field: BitField) -> Self {
        Self { start: field.start(), bits: field.len, order: field.order, signed: field.signed }
    }
}

#[cfg(feature = "serde")]
impl TryFrom<Place> for BitField {
    type Error = OutsideFrame;

    fn try_from(Place { start, bits, order, signed }: Place) -> Result<Self, OutsideFrame> {
        Self::new(start, bits, order, signed)
    }
}
