//! Reads the Xsens MTi: MTData2 messages in Xbus frames (MT Low-Level Communication Protocol, MT0605P).
//!
//! An Xbus frame is `FA FF MID LEN DATA.. CS`; all bytes after FA add up to 0 modulo 256. [`MtData2`] holds the
//! measurements of a frame.

mod emit;
mod mtdata2;

pub use mtdata2::{MID_MT_DATA2, MtData2, XsensError};

use super::framer::{Framer, Protocol};
use crate::sample::{ImuSample, NO_STAMP, StampClock, Validity};
use crate::units::{AngularRate, CentiCelsius, Micros, SpecificForce};
use mtdata2::id;

const PREAMBLE: u8 = 0xFA;
const BUS_ID: u8 = 0xFF;
/// Value of LEN that marks an extended length, which no message here needs.
const EXTENDED_LENGTH: u8 = 0xFF;
/// Bytes of a frame in addition to its data.
const OVERHEAD: usize = 5;
/// Length of the longest frame, bytes.
pub const MAX_FRAME: usize = 254 + OVERHEAD;

/// Bits of the status word that report clipping of accelerometer x, y, z and gyro x, y, z.
const STATUS_CLIPPED: u32 = 0x3F << 8;

/// Bit of the status word that says that the self-test has passed.
const STATUS_SELF_TEST: u32 = 1;

/// The framing of Xbus messages.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Xbus;

impl Protocol for Xbus {
    const HEADER: usize = 4;

    fn length(header: &[u8]) -> Option<usize> {
        match *header {
            // Data that are too long for us, of which the header alone is reported.
            [PREAMBLE, BUS_ID, MID_MT_DATA2, EXTENDED_LENGTH] => Some(Self::HEADER),
            [PREAMBLE, BUS_ID, _, len] if len != EXTENDED_LENGTH => Some(usize::from(len) + OVERHEAD),
            _ => None,
        }
    }

    fn check(frame: &[u8]) -> bool {
        if frame.len() == Self::HEADER {
            return true;
        }
        let (words, rest) = frame.get(1..).unwrap_or_default().as_chunks();
        // Two bytes of a word at once; the 64 words of the longest frame cannot carry over.
        let sums = words.iter().fold(0u32, |sums, word| {
            let word = u32::from_le_bytes(*word);
            sums.wrapping_add(word & 0xFF_00FF).wrapping_add(word >> 8 & 0xFF_00FF)
        });
        let sum = (sums as u8).wrapping_add((sums >> 16) as u8);
        rest.iter().fold(sum, |sum, byte| sum.wrapping_add(*byte)) == 0
    }
}

/// The parser of an MTi: converts bytes to samples with unwrapped time.
#[derive(Debug, Clone, Default)]
pub struct Mti {
    pub(super) framer: Framer<Xbus, MAX_FRAME>,
    /// Unwraps SampleTimeFine, in 10 kHz ticks.
    stamps: StampClock,
}

impl Mti {
    /// Creates a parser that has received nothing.
    pub const fn new() -> Self {
        Self { framer: Framer::new(), stamps: StampClock::START }
    }

    /// Takes bytes, at most to the end of a message, and returns how many; then call [`Source::next_sample`](super::Source::next_sample).
    #[inline]
    pub fn receive_some(&mut self, bytes: &[u8]) -> usize {
        self.framer.receive_some(bytes)
    }

    #[inline(never)]
    pub(super) fn next_message(&mut self) -> Option<Result<ImuSample, XsensError>> {
        let message = match *self.framer.next_frame()? {
            [_, _, MID_MT_DATA2, len, ref data @ .., _] if len != EXTENDED_LENGTH => MtData2::parse(data),
            [_, _, mid, ..] => Err(XsensError::Foreign { mid }),
            _ => return None,
        };
        Some(message.and_then(|message| self.sample(&message)))
    }

    /// Returns the number of bytes that must arrive until [`Source::next_sample`](super::Source::next_sample) can return something.
    #[inline]
    pub fn missing(&self) -> usize {
        self.framer.missing()
    }

    fn sample(&mut self, message: &MtData2) -> Result<ImuSample, XsensError> {
        if message.status.is_some_and(|status| status & STATUS_SELF_TEST == 0) {
            return Err(XsensError::SelfTest);
        }
        let missing = |id| XsensError::Missing { id };
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
            validity: Validity::reported(message.status.is_some_and(|status| status & STATUS_CLIPPED != 0)),
            time: message.sample_time_fine.map_or(NO_STAMP, |ticks| Micros(self.stamps.unwrap(ticks) * 100)),
        })
    }
}

/// Converts degrees to hundredths; `None` if the reading is out of range or not a number.
fn centi_celsius(degrees: f32) -> Option<CentiCelsius> {
    let code = libm::roundf(degrees * 100.0);
    (code >= f32::from(i16::MIN) && code <= f32::from(i16::MAX)).then_some(CentiCelsius(code as i16))
}
