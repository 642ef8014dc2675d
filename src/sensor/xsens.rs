//! Xsens MTi: MTData2 messages in Xbus frames (MT Low-Level Communication Protocol, MT0605P).
//!
//! A frame is `FA FF MID LEN DATA.. CS`, all of it after FA adding up to 0 modulo 256. MTData2
//! (MID 36) holds packets `ID ID LEN DATA..`, big-endian. The low nibble of an ID is precision
//! and coordinate system; this parser takes single precision.

use super::framer::{Candidate, Framer, Protocol};
use crate::sample::ImuSample;
use crate::units::{AngularRate, CentiCelsius, Micros, RangeError, SpecificForce};
use heapless::Vec;

const PREAMBLE: u8 = 0xFA;
const BUS_ID: u8 = 0xFF;
/// Message identifier of MTData2.
pub const MID_MT_DATA2: u8 = 0x36;
/// A LEN of this value announces an extended length, which MTData2 at 100 Hz never needs.
const EXTENDED_LENGTH: u8 = 0xFF;
/// Bytes of a frame around its data.
const OVERHEAD: usize = 5;
/// The longest frame.
pub const MAX_FRAME: usize = 254 + OVERHEAD;

/// Data identifiers, precision and coordinate system masked out.
mod id {
    pub const MASK: u16 = 0xFFF0;
    pub const PACKET_COUNTER: u16 = 0x1020;
    pub const SAMPLE_TIME_FINE: u16 = 0x1060;
    pub const TEMPERATURE: u16 = 0x0810;
    pub const ACCELERATION: u16 = 0x4020;
    pub const RATE_OF_TURN: u16 = 0x8020;
    pub const STATUS_WORD: u16 = 0xE020;
}

/// Clipping of accelerometer x, y, z and gyro x, y, z in the status word.
const STATUS_CLIPPED: u32 = 0x3F << 8;

/// The framing of Xbus.
#[derive(Debug, Clone, Copy, Default)]
pub struct Xbus;

impl Protocol for Xbus {
    fn candidate(bytes: &[u8]) -> Candidate {
        match *bytes {
            [PREAMBLE] | [PREAMBLE, BUS_ID] | [PREAMBLE, BUS_ID, _] => Candidate::Incomplete,
            [PREAMBLE, BUS_ID, _, EXTENDED_LENGTH, ..] => Candidate::No,
            [PREAMBLE, BUS_ID, _, len, ..] => {
                let len = usize::from(len) + OVERHEAD;
                if bytes.len() < len { Candidate::Incomplete } else { Candidate::Frame(len) }
            }
            _ => Candidate::No,
        }
    }

    fn check(frame: &[u8]) -> bool {
        frame.iter().skip(1).fold(0u8, |sum, byte| sum.wrapping_add(*byte)) == 0
    }
}

/// Why an intact MTData2 frame gives no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum XsensError {
    /// A packet is longer than what is left of the message.
    Truncated {
        /// Its identifier.
        id: u16,
    },
    /// A packet that is needed has a length or precision that is not single precision.
    Format {
        /// Its identifier.
        id: u16,
    },
    /// The message lacks a packet that is needed.
    Missing {
        /// Its identifier.
        id: u16,
    },
    /// A reading that no part of this kind can measure.
    Reading {
        /// Identifier of the packet.
        id: u16,
        /// What is wrong with it.
        error: RangeError,
    },
}

impl core::fmt::Display for XsensError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Truncated { id } => write!(f, "MTData2: packet {id:04x} is cut off"),
            Self::Format { id } => write!(f, "MTData2: packet {id:04x} is not in single precision"),
            Self::Missing { id } => write!(f, "MTData2: packet {id:04x} is missing"),
            Self::Reading { id, error } => write!(f, "MTData2: packet {id:04x}: {error}"),
        }
    }
}

impl core::error::Error for XsensError {}

/// What an MTData2 message says, as far as it is used here.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MtData2 {
    /// Message counter, wraps.
    pub packet_counter: Option<u16>,
    /// 10 kHz ticks, wraps.
    pub sample_time_fine: Option<u32>,
    /// Specific force x, y, z, m/s^2.
    pub acceleration: Option<[f32; 3]>,
    /// Angular rate x, y, z, rad/s.
    pub rate_of_turn: Option<[f32; 3]>,
    /// deg C.
    pub temperature: Option<f32>,
    /// Status word.
    pub status: Option<u32>,
}

impl MtData2 {
    /// Reads the packets of a message; unknown ones are passed over.
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
                // Bits 0 and 1 are the precision: 0 is single.
                id::TEMPERATURE | id::ACCELERATION | id::RATE_OF_TURN if lo & 3 != 0 => return Err(format),
                id::TEMPERATURE => {
                    message.temperature = Some(f32::from_bits(word(packet).ok_or(format)?));
                }
                id::ACCELERATION => message.acceleration = Some(vector(packet).ok_or(format)?),
                id::RATE_OF_TURN => message.rate_of_turn = Some(vector(packet).ok_or(format)?),
                _ => {}
            }
        }
        if data.is_empty() { Ok(message) } else { Err(XsensError::Truncated { id: 0 }) }
    }

    /// The whole frame of this message, absent packets left out.
    #[must_use]
    pub fn emit(&self) -> Vec<u8, 72> {
        let mut frame = Vec::new();
        let mut packet = |id: u16, bytes: &[u8]| {
            // 72 bytes hold all six packets.
            let _ = frame.extend_from_slice(&id.to_be_bytes());
            let _ = frame.push(bytes.len() as u8);
            let _ = frame.extend_from_slice(bytes);
        };
        packet(u16::from_be_bytes([PREAMBLE, BUS_ID]), &[]);
        if let Some(counter) = self.packet_counter {
            packet(id::PACKET_COUNTER, &counter.to_be_bytes());
        }
        if let Some(time) = self.sample_time_fine {
            packet(id::SAMPLE_TIME_FINE, &time.to_be_bytes());
        }
        for (id, values) in [(id::ACCELERATION, self.acceleration), (id::RATE_OF_TURN, self.rate_of_turn)] {
            if let Some(values) = values {
                let mut bytes = [0; 12];
                for (to, value) in bytes.chunks_exact_mut(4).zip(values) {
                    to.copy_from_slice(&value.to_be_bytes());
                }
                packet(id, &bytes);
            }
        }
        if let Some(temperature) = self.temperature {
            packet(id::TEMPERATURE, &temperature.to_be_bytes());
        }
        if let Some(status) = self.status {
            packet(id::STATUS_WORD, &status.to_be_bytes());
        }
        finish(frame)
    }
}

/// Puts message identifier and length behind the preamble and the checksum at the end.
fn finish(mut frame: Vec<u8, 72>) -> Vec<u8, 72> {
    // The preamble was written as a packet of no bytes: its length byte becomes the MID.
    let data_len = frame.len() - 3;
    frame[2] = MID_MT_DATA2;
    let _ = frame.insert(3, data_len as u8);
    let sum = frame.iter().skip(1).fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    let _ = frame.push(sum.wrapping_neg());
    frame
}

fn word(packet: &[u8]) -> Option<u32> {
    packet.try_into().ok().map(u32::from_be_bytes)
}

fn vector(packet: &[u8]) -> Option<[f32; 3]> {
    let bytes: &[u8; 12] = packet.try_into().ok()?;
    let (words, _) = bytes.as_chunks::<4>();
    Some(core::array::from_fn(|axis| f32::from_be_bytes(words[axis])))
}

/// An MTi at the end of a cable: bytes in, samples with unwrapped time out.
#[derive(Debug, Clone, Default)]
pub struct Mti {
    framer: Framer<Xbus, MAX_FRAME>,
    /// Last SampleTimeFine and the time it stands for.
    time: Option<(u32, u64)>,
}

impl Mti {
    /// Nothing received yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { framer: Framer::new(), time: None }
    }

    /// Takes one byte. Call [`Mti::next_sample`] until `None` before the next one.
    pub fn push(&mut self, byte: u8) {
        self.framer.push(byte);
    }

    /// The next sample, or why an intact data message is none. Other messages are passed over.
    pub fn next_sample(&mut self) -> Option<Result<ImuSample, XsensError>> {
        loop {
            let frame = self.framer.next_frame()?;
            if frame.get(2) == Some(&MID_MT_DATA2) {
                let message = frame.get(4..frame.len() - 1).map_or(Ok(MtData2::default()), MtData2::parse);
                return Some(message.and_then(|message| self.sample(&message)));
            }
        }
    }

    /// Candidates whose checksum did not fit.
    #[must_use]
    pub fn bad_checksums(&self) -> u32 {
        self.framer.bad_checksums()
    }

    fn sample(&mut self, message: &MtData2) -> Result<ImuSample, XsensError> {
        let missing = |id| XsensError::Missing { id };
        let ticks = message.sample_time_fine.ok_or(missing(id::SAMPLE_TIME_FINE))?;
        let force = message.acceleration.ok_or(missing(id::ACCELERATION))?;
        let rate = message.rate_of_turn.ok_or(missing(id::RATE_OF_TURN))?;
        let reading = |id| move |error| XsensError::Reading { id, error };
        let [fx, fy, fz] = force.map(SpecificForce::from_metre_per_sec2);
        let [wx, wy, wz] = rate.map(AngularRate::from_rad_per_sec);
        let (a, r) = (reading(id::ACCELERATION), reading(id::RATE_OF_TURN));
        Ok(ImuSample {
            specific_force: [fx.map_err(a)?, fy.map_err(a)?, fz.map_err(a)?],
            angular_rate: [wx.map_err(r)?, wy.map_err(r)?, wz.map_err(r)?],
            temperature: message.temperature.and_then(centi_celsius),
            clipped: message.status.is_some_and(|status| status & STATUS_CLIPPED != 0),
            time: self.unwrap_time(ticks),
        })
    }

    /// 10 kHz ticks of 32 bits (119 hours) to microseconds that never wrap. Ticks that go
    /// back by less than half the range are a step back, not a wrap.
    fn unwrap_time(&mut self, ticks: u32) -> Micros {
        let base = match self.time {
            None => u64::from(ticks),
            Some((last, base)) => base.saturating_add_signed(i64::from(ticks.wrapping_sub(last) as i32)),
        };
        self.time = Some((ticks, base));
        Micros(base * 100)
    }
}

/// Hundredths of a degree, where the reading is one.
fn centi_celsius(degrees: f32) -> Option<CentiCelsius> {
    let code = libm::roundf(degrees * 100.0);
    (code >= f32::from(i16::MIN) && code <= f32::from(i16::MAX)).then_some(CentiCelsius(code as i16))
}
