//! Encodes MTData2 messages as an MTi sends them, for simulations and tests.

use super::mtdata2::{MID_MT_DATA2, MtData2, Precision, id};
use super::{BUS_ID, EXTENDED_LENGTH, PREAMBLE};
use crate::sample::ImuSample;
use heapless::Vec;

/// Length of the longest frame that [`MtData2::emit_as`] returns, bytes.
const MAX_EMITTED: usize = 96;

impl MtData2 {
    /// The message of a sample, as an MTi sends it.
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
    pub fn emit(&self) -> Vec<u8, 72> {
        // 72 bytes hold all six packets.
        frame(MID_MT_DATA2, &self.data(Precision::Single)).unwrap_or_default()
    }

    /// Encodes the whole frame with its numbers in the given precision.
    pub fn emit_as(&self, precision: Precision) -> Vec<u8, MAX_EMITTED> {
        frame(MID_MT_DATA2, &self.data(precision)).unwrap_or_default()
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

impl Precision {
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

/// Encodes the frame of a message; `None` if it is longer than `N` bytes or than an Xbus frame.
fn frame<const N: usize>(mid: u8, data: &[u8]) -> Option<Vec<u8, N>> {
    let len = u8::try_from(data.len()).ok().filter(|len| *len != EXTENDED_LENGTH)?;
    let mut frame = Vec::new();
    frame.extend_from_slice(&[PREAMBLE, BUS_ID, mid, len]).ok()?;
    frame.extend_from_slice(data).ok()?;
    let sum = frame.iter().skip(1).fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    frame.push(sum.wrapping_neg()).ok()?;
    Some(frame)
}
