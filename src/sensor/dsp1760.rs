//! Reads the KVH DSP-1760 fibre-optic gyro (and the 1725, 1750, 1775 units, which use the same
//! messages): RS-422, 921600 baud 8N1.
//!
//! A message contains neither its unit nor its period. The gyro must have its factory settings (increments of the angle in
//! radians, whole deg C) and send 1000 messages a second. Format A carries no time stamp, only a sequence number; its
//! time is the number of messages, lost ones included, times the period. The sequence number wraps at 128, so it does not reveal a loss of 128 messages or
//! more. The time stamps of format B reveal it, or the arrival times do ([`crate::align`]).

mod framing;
#[doc(hidden)]
pub mod message;

pub use framing::Kvh;

use super::framer::Framer;
use crate::sample::{FogSample, StampClock};
use crate::units::{Angle, CentiCelsius, Micros};
use framing::is_self_test;
use message::{Extra, MAX_MESSAGE, MAX_SEQUENCE, Message, MessageError, Validity};

/// The reason why an intact frame gives no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Dsp1760Error {
    /// The content of the frame is invalid.
    #[error(transparent)]
    Message(MessageError),
    /// The sequence number equals the previous one: the message is repeated.
    #[error("DSP-1760: message {sequence} is repeated")]
    Repeated {
        /// The sequence number.
        sequence: u8,
    },
}

const PERIOD_US: u32 = 1_000;
/// The gyro's range ends at 490 deg/s, rad in a period. In degrees taken for radians that is 8.6 deg/s.
const MAX_INCREMENT: f32 = 490.0 * core::f32::consts::PI / 180.0 * 1e-6 * PERIOD_US as f32;

/// The parser of a DSP-1760: converts bytes to increments with unwrapped time.
#[derive(Debug, Clone, Default)]
pub struct Dsp1760 {
    pub(super) framer: Framer<Kvh, MAX_MESSAGE>,
    last_sequence: Option<u8>,
    /// All messages, lost ones included, times the period, microseconds.
    time: u64,
    stamps: StampClock,
}

impl Dsp1760 {
    /// Creates a parser that has received nothing.
    pub const fn new() -> Self {
        Self { framer: Framer::new(), last_sequence: None, time: 0, stamps: StampClock::START }
    }

    /// Takes bytes, at most to the end of a message, and returns how many; then call [`Source::next_sample`](super::Source::next_sample).
    #[inline]
    pub fn receive_some(&mut self, bytes: &[u8]) -> usize {
        self.framer.receive_some(bytes)
    }

    /// Built-in-test messages are skipped.
    #[inline(never)]
    pub(super) fn next_message(&mut self) -> Option<Result<FogSample, Dsp1760Error>> {
        loop {
            let frame = self.framer.next_frame()?;
            if is_self_test(frame) {
                continue;
            }
            let message = match Message::parse(frame) {
                Ok(message) => message,
                Err(error) => return Some(Err(Dsp1760Error::Message(error))),
            };
            return Some(self.sample(&message));
        }
    }

    fn sample(&mut self, message: &Message) -> Result<FogSample, Dsp1760Error> {
        let sequence = message.sequence;
        let steps = self.last_sequence.map_or(1, |last| sequence.wrapping_sub(last) & MAX_SEQUENCE);
        if steps == 0 {
            return Err(Dsp1760Error::Repeated { sequence });
        }
        self.last_sequence = Some(sequence);
        let lost = u32::from(steps) - 1;
        self.time += u64::from(u32::from(steps) * PERIOD_US);
        let (time, temperature) = match message.extra {
            Extra::Temperature(temperature) => (self.time, temperature),
            Extra::Timed { time, temperature } => (self.stamps.unwrap(time), temperature),
        };
        let increment = increments(&message.rotation, message.validity);
        let temperature = temperature.checked_mul(100).map(CentiCelsius);
        Ok(FogSample { time: Micros(time), span: PERIOD_US, lost, increment, temperature })
    }
}

#[inline]
fn increments(rotation: &[f32; 3], validity: Validity) -> [Option<Angle>; 3] {
    core::array::from_fn(|axis| {
        let angle = rotation[axis];
        let is_good = validity.gyro(axis) && (-MAX_INCREMENT..=MAX_INCREMENT).contains(&angle);
        if is_good { Angle::from_rad(angle).ok() } else { None }
    })
}
