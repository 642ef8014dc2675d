//! MTData2 (MID 36) consists of packets `ID ID LEN DATA..`, big-endian. The low nibble of an ID gives precision and
//! coordinate system. The coordinate system affects only orientations; the readings used here are in sensor axes.

use crate::units::RangeError;

/// Message identifier of MTData2.
pub const MID_MT_DATA2: u8 = 0x36;

/// The data identifiers, without precision and coordinate system.
pub mod id {
    /// Mask that removes precision and coordinate system.
    pub const MASK: u16 = 0xFFF0;
    /// Message counter: u16, wraps.
    pub const PACKET_COUNTER: u16 = 0x1020;
    /// Time of the sensor: u32, 10 kHz ticks, wraps.
    pub const SAMPLE_TIME_FINE: u16 = 0x1060;
    /// Temperature, deg C.
    pub const TEMPERATURE: u16 = 0x0810;
    /// Specific force x, y, z, m/s^2.
    pub const ACCELERATION: u16 = 0x4020;
    /// Angular rate x, y, z, rad/s.
    pub const RATE_OF_TURN: u16 = 0x8020;
    /// Status of self-test, filter and clipping: u32.
    pub const STATUS_WORD: u16 = 0xE020;
}

/// The reason why an intact MTData2 frame gives no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "its messages say it")]
pub enum XsensError {
    /// For example one of the old protocol (MID 32), or an error (42).
    #[error("MTi: message {mid:02x} is no MTData2 of up to 254 bytes")]
    Foreign { mid: u8 },
    #[error("MTi: the self-test has failed")]
    SelfTest,
    #[error("MTData2: packet {id:04x} is cut off")]
    Truncated { id: u16 },
    #[error("MTData2: packet {id:04x} does not have the length of its precision")]
    Format { id: u16 },
    #[error("MTData2: packet {id:04x} is missing")]
    Missing { id: u16 },
    #[error("MTData2: packet {id:04x}: {error}")]
    Reading { id: u16, error: RangeError },
}

/// The content of an MTData2 message, as far as it is used.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MtData2 {
    /// Message counter, wraps.
    pub packet_counter: Option<u16>,
    /// Time of the sample, 10 kHz ticks, wraps.
    pub sample_time_fine: Option<u32>,
    /// Specific force x, y, z, m/s^2.
    pub acceleration: Option<[f32; 3]>,
    /// Angular rate x, y, z, rad/s.
    pub rate_of_turn: Option<[f32; 3]>,
    /// Temperature, deg C.
    pub temperature: Option<f32>,
    /// Status word.
    pub status: Option<u32>,
}

impl MtData2 {
    /// Parses the packets of a message; unknown packets are skipped.
    ///
    /// # Errors
    /// [`XsensError::Truncated`] and [`XsensError::Format`].
    pub fn parse(mut data: &[u8]) -> Result<Self, XsensError> {
        let mut message = Self::default();
        while let &[hi, lo, len, ref rest @ ..] = data {
            let full_id = u16::from_be_bytes([hi, lo]);
            let (packet, rest) =
                rest.split_at_checked(usize::from(len)).ok_or(XsensError::Truncated { id: full_id })?;
            data = rest;
            let format = XsensError::Format { id: full_id };
            match full_id & id::MASK {
                id::PACKET_COUNTER => {
                    message.packet_counter = Some(u16::from_be_bytes(packet.try_into().map_err(|_| format)?));
                }
                id::SAMPLE_TIME_FINE => message.sample_time_fine = Some(word(packet).ok_or(format)?),
                id::STATUS_WORD => message.status = Some(word(packet).ok_or(format)?),
                id::TEMPERATURE => {
                    message.temperature = Some(Precision::of(full_id).parse_f32(packet).ok_or(format)?);
                }
                id::ACCELERATION => message.acceleration = Some(vector(full_id, packet).ok_or(format)?),
                id::RATE_OF_TURN => message.rate_of_turn = Some(vector(full_id, packet).ok_or(format)?),
                _ => {}
            }
        }
        if data.is_empty() { Ok(message) } else { Err(XsensError::Truncated { id: 0 }) }
    }
}

fn word(packet: &[u8]) -> Option<u32> {
    packet.try_into().ok().map(u32::from_be_bytes)
}

fn vector(id: u16, packet: &[u8]) -> Option<[f32; 3]> {
    let precision = Precision::of(id);
    let mut numbers = packet.chunks_exact(precision.bytes());
    let mut next = || numbers.next().and_then(|bytes| precision.parse_f32(bytes));
    let values = [next()?, next()?, next()?];
    (packet.len() == 3 * precision.bytes()).then_some(values)
}

/// The format of a number, selected by bits 0 and 1 of the data identifier; all are big-endian.
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
    pub const fn of(id: u16) -> Self {
        match id & 3 {
            0 => Self::Single,
            1 => Self::Fixed1220,
            2 => Self::Fixed1632,
            _ => Self::Double,
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
}
