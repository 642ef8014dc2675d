//! Encodes MTData2 messages as an MTi sends them, for simulations and tests.

use super::mtdata2::{MID_MT_DATA2, MtData2, id};
use super::{BUS_ID, PREAMBLE};
use crate::sample::ImuSample;
use heapless::Vec;

const MAX_EMITTED: usize = 72;

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

    /// Encodes the whole frame; fields that are `None` are omitted.
    pub fn emit(&self) -> Vec<u8, MAX_EMITTED> {
        let mut frame = Vec::new();
        // MAX_EMITTED bytes hold all packets.
        let mut put = |bytes: &[u8]| drop(frame.extend_from_slice(bytes));
        put(&[PREAMBLE, BUS_ID, MID_MT_DATA2, 0]);
        let mut packet = |id: u16, bytes: &[u8]| {
            put(&id.to_be_bytes());
            put(&[bytes.len() as u8]);
            put(bytes);
        };
        let numbers =
            |values: &[f32]| values.iter().flat_map(|value| value.to_be_bytes()).collect::<Vec<u8, 12>>();
        if let Some(counter) = self.packet_counter {
            packet(id::PACKET_COUNTER, &counter.to_be_bytes());
        }
        if let Some(time) = self.sample_time_fine {
            packet(id::SAMPLE_TIME_FINE, &time.to_be_bytes());
        }
        if let Some(values) = &self.acceleration {
            packet(id::ACCELERATION, &numbers(values));
        }
        if let Some(values) = &self.rate_of_turn {
            packet(id::RATE_OF_TURN, &numbers(values));
        }
        if let Some(temperature) = self.temperature {
            packet(id::TEMPERATURE, &numbers(&[temperature]));
        }
        if let Some(status) = self.status {
            packet(id::STATUS_WORD, &status.to_be_bytes());
        }
        let length = frame.len().saturating_sub(4) as u8;
        frame.iter_mut().skip(3).take(1).for_each(|place| *place = length);
        let sum = frame.iter().skip(1).fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        let _ = frame.push(sum.wrapping_neg());
        frame
    }
}
