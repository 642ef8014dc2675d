//! MTData2 (MID 36) consists of packets `ID ID LEN DATA..`, big-endian. The low nibble of an ID gives precision and
//! coordinate system. The coordinate system affects only orientations; the readings used here are in sensor axes.

use super::precision::Precision;
use super::xbus;
use crate::sample::ImuSample;
use crate::units::RangeError;
use heapless::Vec;

/// Message identifier of MTData2.
pub const MID_MT_DATA2: u8 = 0x36;
/// Length of the longest frame that [`MtData2::emit_as`] returns, bytes.
pub const MAX_EMITTED: usize = 96;

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
pub enum XsensError {
    /// A packet is longer than the rest of the message.
    #[error("MTData2: packet {id:04x} is cut off")]
    Truncated {
        /// Identifier of the packet.
        id: u16,
    },
    /// A packet that is used does not have the length of its format.
    #[error("MTData2: packet {id:04x} does not have the length of its precision")]
    Format {
        /// Identifier of the packet.
        id: u16,
    },
    /// The message lacks a packet that is needed.
    #[error("MTData2: packet {id:04x} is missing")]
    Missing {
        /// Identifier of the packet.
        id: u16,
    },
    /// A reading is out of range.
    #[error("MTData2: packet {id:04x}: {error}")]
    Reading {
        /// Identifier of the packet.
        id: u16,
        /// Error of the reading.
        error: RangeError,
    },
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

    /// The message of a sample, as an MTi sends it.
    #[must_use]
    pub fn of(sample: &ImuSample, number: u16) -> Self {
        Self {
            packet_counter: Some(number),
            sample_time_fine: Some((sample.time.0 / 100) as u32),
            acceleration: Some(sample.specific_force.map(|force| force.metre_per_sec2() as f32)),
            rate_of_turn: Some(sample.angular_rate.map(|rate| rate.rad_per_sec() as f32)),
            temperature: sample.temperature.map(|temperature| f32::from(temperature.0) / 100.0),
            status: Some(3),
        }
    }

    /// Encodes the whole frame in single precision; fields that are `None` are omitted.
    #[must_use]
    pub fn emit(&self) -> Vec<u8, 72> {
        // 72 bytes hold all six packets.
        xbus::emit(MID_MT_DATA2, &self.data(Precision::Single)).unwrap_or_default()
    }

    /// Encodes the whole frame with its numbers in the given precision.
    #[must_use]
    pub fn emit_as(&self, precision: Precision) -> Vec<u8, MAX_EMITTED> {
        xbus::emit(MID_MT_DATA2, &self.data(precision)).unwrap_or_default()
    }

    /// Encodes all packets that are present.
    fn data(&self, precision: Precision) -> Vec<u8, MAX_EMITTED> {
        let mut data = Vec::new();
        // MAX_EMITTED bytes hold all six packets in the longest precision, double.
        let mut packet = |id: u16, bytes: &[u8]| {
            let _ = data.extend_from_slice(&id.to_be_bytes());
            let _ = data.push(bytes.len() as u8);
            let _ = data.extend_from_slice(bytes);
        };
        let numbers = |values: &[f32]| {
            let mut bytes = Vec::<u8, 24>::new();
            for value in values {
                let _ = bytes.extend_from_slice(&precision.emit((*value).into()));
            }
            bytes
        };
        if let Some(counter) = self.packet_counter {
            packet(id::PACKET_COUNTER, &counter.to_be_bytes());
        }
        if let Some(time) = self.sample_time_fine {
            packet(id::SAMPLE_TIME_FINE, &time.to_be_bytes());
        }
        if let Some(values) = &self.acceleration {
            packet(precision.mark(id::ACCELERATION), &numbers(values));
        }
        if let Some(values) = &self.rate_of_turn {
            packet(precision.mark(id::RATE_OF_TURN), &numbers(values));
        }
        if let Some(temperature) = self.temperature {
            packet(precision.mark(id::TEMPERATURE), &numbers(&[temperature]));
        }
        if let Some(status) = self.status {
            packet(id::STATUS_WORD, &status.to_be_bytes());
        }
        data
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
