//! A number in MTData2 has one of four formats, selected by bits 0 and 1 of the data identifier.

use heapless::Vec;

/// The format of a number; all are big-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Precision {
    /// f32.
    Single,
    /// i32 with 20 bits of fraction.
    Fixed1220,
    /// 48 bits with 32 bits of fraction; the 32 fraction bits are sent before the 16 integer bits.
    Fixed1632,
    /// f64.
    Double,
}

impl Precision {
    /// Returns the precision that a data identifier selects.
    #[must_use]
    pub const fn of(id: u16) -> Self {
        match id & 3 {
            0 => Self::Single,
            1 => Self::Fixed1220,
            2 => Self::Fixed1632,
            _ => Self::Double,
        }
    }

    /// Returns the data identifier for this precision.
    #[must_use]
    pub const fn mark(self, id: u16) -> u16 {
        id & !3
            | match self {
                Self::Single => 0,
                Self::Fixed1220 => 1,
                Self::Fixed1632 => 2,
                Self::Double => 3,
            }
    }

    /// Returns the length of a number, bytes.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Single | Self::Fixed1220 => 4,
            Self::Fixed1632 => 6,
            Self::Double => 8,
        }
    }

    /// Decodes a number, exactly; `None` if the length of `bytes` is wrong.
    #[must_use]
    pub fn parse(self, bytes: &[u8]) -> Option<f64> {
        match (self, bytes) {
            (Self::Single, &[a, b, c, d]) => Some(f32::from_be_bytes([a, b, c, d]).into()),
            (Self::Fixed1220, &[a, b, c, d]) => {
                Some(f64::from(i32::from_be_bytes([a, b, c, d])) / f64::from(1 << 20))
            }
            (Self::Fixed1632, &[f3, f2, f1, f0, i1, i0]) => {
                let sign = if i1 & 0x80 == 0 { 0 } else { 0xFF };
                let code = i64::from_be_bytes([sign, sign, i1, i0, f3, f2, f1, f0]);
                Some(code as f64 / (1u64 << 32) as f64)
            }
            (Self::Double, &[a, b, c, d, e, f, g, h]) => Some(f64::from_be_bytes([a, b, c, d, e, f, g, h])),
            _ => None,
        }
    }

    /// Decodes a number and rounds it once to f32. Where possible no f64 arithmetic is used, because some targets
    /// compute f64 in software.
    #[must_use]
    pub fn parse_f32(self, bytes: &[u8]) -> Option<f32> {
        match (self, bytes) {
            (Self::Single, &[a, b, c, d]) => Some(f32::from_be_bytes([a, b, c, d])),
            // The conversion rounds; the division by a power of two is exact.
            (Self::Fixed1220, &[a, b, c, d]) => {
                Some(i32::from_be_bytes([a, b, c, d]) as f32 / (1 << 20) as f32)
            }
            _ => self.parse(bytes).map(|value| value as f32),
        }
    }

    /// Encodes the nearest number; the fixed-point formats clamp to their range.
    #[must_use]
    pub fn emit(self, value: f64) -> Vec<u8, 8> {
        let mut bytes = Vec::new();
        // Eight bytes hold each format; a cast from float to integer clamps.
        let _ = match self {
            Self::Single => bytes.extend_from_slice(&(value as f32).to_be_bytes()),
            Self::Fixed1220 => {
                let code = libm::round(value * f64::from(1 << 20)) as i32;
                bytes.extend_from_slice(&code.to_be_bytes())
            }
            Self::Fixed1632 => {
                let code = libm::round(value * (1u64 << 32) as f64) as i64;
                let [_, _, i1, i0, f3, f2, f1, f0] = code.clamp(-(1 << 47), (1 << 47) - 1).to_be_bytes();
                bytes.extend_from_slice(&[f3, f2, f1, f0, i1, i0])
            }
            Self::Double => bytes.extend_from_slice(&value.to_be_bytes()),
        };
        bytes
    }
}
