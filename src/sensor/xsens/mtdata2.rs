//! MTData2 (MID 36) consists of packets `ID ID LEN DATA..`, big-endian. The low nibble of an ID gives precision and
//! coordinate system. The coordinate system affects only orientations; the readings used here are in sensor axes.

use crate::units::RangeError;

/// Message identifier of MTData2.
pub const MID_MT_DATA2: u8 = 0x36;

pub mod id {
    /// Mask that removes precision and coordinate system.
    pub const MASK: u16 = 0xFFF0;
    /// Mask of the precision: zero is f32.
    pub const PRECISION: u16 = 3;
    /// Message counter: u16, wraps.
    pub const PACKET_COUNTER: u16 = 0x1020;
    /// Time of the sensor: u32, 10 kHz ticks, wraps.
    pub const SAMPLE_TIME_FINE: u16 = 0x1060;
    pub const TEMPERATURE: u16 = 0x0810;
    /// Specific force x, y, z, m/s^2.
    pub const ACCELERATION: u16 = 0x4020;
    /// Angular rate x, y, z, rad/s.
    pub const RATE_OF_TURN: u16 = 0x8020;
    /// Status of self-test, filter and clipping: u32.
    pub const STATUS_WORD: u16 = 0xE020;
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum XsensError {
    /// For example one of the old protocol (MID 32), or an error (42).
    #[error("MTi: message {mid:02x} is no MTData2 of up to 254 bytes")]
    Foreign { mid: u8 },
    #[error("MTi: the self-test has failed")]
    SelfTest,
    #[error("MTData2: packet {id:04x} is cut off")]
    Truncated { id: u16 },
    #[error("MTData2: packet {id:04x} does not have its length in float: set the MTi's precision to float")]
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
                    let [degrees] = numbers(full_id, packet).ok_or(format)?;
                    message.temperature = Some(degrees);
                }
                id::ACCELERATION => message.acceleration = Some(numbers(full_id, packet).ok_or(format)?),
                id::RATE_OF_TURN => message.rate_of_turn = Some(numbers(full_id, packet).ok_or(format)?),
                _ => {}
            }
        }
        if data.is_empty() { Ok(message) } else { Err(XsensError::Truncated { id: 0 }) }
    }
}

fn word(packet: &[u8]) -> Option<u32> {
    let &[a, b, c, d] = packet else { return None };
    Some(u32::from_be_bytes([a, b, c, d]))
}

/// Decodes numbers of f32, the MTi's default precision; `None` for another one, or another length.
fn numbers<const N: usize>(id: u16, packet: &[u8]) -> Option<[f32; N]> {
    let (words, rest) = packet.as_chunks::<4>();
    let words: &[[u8; 4]; N] = words.try_into().ok()?;
    let number = |word: &[u8; 4]| f32::from_be_bytes(*word);
    (id & id::PRECISION == 0 && rest.is_empty()).then(|| words.each_ref().map(number))
}
