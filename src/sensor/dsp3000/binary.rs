//! Parses the variant of the DSP-3000 that sends words of 32 bits, most significant byte first.
//!
//! | bit | content |
//! |---|---|
//! | 31 | valid |
//! | 30-29 | sync |
//! | 28-27 | 0 rate, 1 incremental, 2 integrated |
//! | 26 | odd parity over all 32 bits |
//! | 25-0 | two's complement; integrated: 25-23 turns, 22-0 angle within a turn |
//!
//! One parity bit is a weak check: after a lost or extra byte, half of the wrong words would pass. Two things keep
//! the parser in step. First, the gyro is silent for 0.65 of every millisecond: if the caller then calls
//! [`Dsp3000Binary::pause`], a lost byte gives no wrong word. Second, a gyro sends only one type: [`Dsp3000Binary`]
//! accepts a phase of the four bytes only after [`LOCK`] good words of the expected type and sync in a row, and
//! searches again after one bad word. Without the pauses, a lost byte gives wrong readings until a word fails. Their
//! number has no bound: a test saw four.

use super::Mode;
use crate::sample::FogSample;
use crate::units::Micros;
use heapless::Vec;

/// LSB of a rate, deg/s.
pub const RATE_LSB: f64 = 60e-6;
/// LSB of an increment, deg.
pub const INCREMENT_LSB: f64 = 6e-6;
/// LSB of an integrated angle, deg: 360 / 2^23.
pub const ANGLE_LSB: f64 = 360.0 / (1 << 23) as f64;
/// Number of good words in a row after which a phase is accepted.
pub const LOCK: u8 = 4;

const VALID: u32 = 1 << 31;
const PARITY: u32 = 1 << 26;
const VALUE_MASK: u32 = PARITY - 1;

/// The content of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Word {
    /// True if the gyro marks the value as valid.
    pub valid: bool,
    /// Sync bits, 0 to 3.
    pub sync: u8,
    /// Kind of the value.
    pub mode: Mode,
    /// Value of 26 bits, two's complement. For [`Mode::Integrated`] it is an angle that wraps after eight turns: the
    /// bits above 22 count turns.
    pub value: i32,
}

/// The reason why four bytes are not a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WordError {
    /// The word has an even number of ones.
    #[error("DSP-3000: word {word:08x} has even parity")]
    Parity {
        /// The word.
        word: u32,
    },
    /// The word has type 3, which does not exist.
    #[error("DSP-3000: word {word:08x} has an unknown type")]
    Type {
        /// The word.
        word: u32,
    },
}

impl Word {
    /// Parses a word.
    ///
    /// # Errors
    /// [`WordError`].
    pub fn parse(bytes: [u8; 4]) -> Result<Self, WordError> {
        let word = u32::from_be_bytes(bytes);
        if word.count_ones().is_multiple_of(2) {
            return Err(WordError::Parity { word });
        }
        let mode = match word >> 27 & 3 {
            0 => Mode::Rate,
            1 => Mode::Incremental,
            2 => Mode::Integrated,
            _ => return Err(WordError::Type { word }),
        };
        let value = ((word & VALUE_MASK) << 6) as i32 >> 6;
        Ok(Self { valid: word & VALID != 0, sync: (word >> 29 & 3) as u8, mode, value })
    }

    /// Encodes the word; of the value, only the low 26 bits are sent.
    #[must_use]
    pub const fn emit(&self) -> [u8; 4] {
        let mode = match self.mode {
            Mode::Rate => 0,
            Mode::Incremental => 1,
            Mode::Integrated => 2,
        };
        let valid = if self.valid { VALID } else { 0 };
        let word = valid | (self.sync as u32 & 3) << 29 | mode << 27 | self.value as u32 & VALUE_MASK;
        let parity = if word.count_ones().is_multiple_of(2) { PARITY } else { 0 };
        (word | parity).to_be_bytes()
    }

    /// Creates the sample of a rate or increment that arrived at `now` and covers `span` microseconds. `None` for an
    /// integrated angle: set the gyro to increments instead.
    #[must_use]
    pub fn sample(&self, now: Micros, span: u32) -> Option<FogSample> {
        super::sample(self.mode, self.degrees() as f32, self.valid, now, span)
    }

    /// Returns the rate in deg/s, or the increment or angle in deg; an angle includes whole turns.
    #[must_use]
    pub fn degrees(&self) -> f64 {
        let lsb = match self.mode {
            Mode::Rate => RATE_LSB,
            Mode::Incremental => INCREMENT_LSB,
            Mode::Integrated => ANGLE_LSB,
        };
        f64::from(self.value) * lsb
    }
}

/// The parser: assembles words from bytes and parses them.
#[derive(Debug, Clone)]
pub struct Dsp3000Binary {
    mode: Mode,
    sync: u8,
    bytes: Vec<u8, 4>,
    /// Number of good words in a row, at most [`LOCK`].
    good: u8,
    /// Number of times that the phase was lost.
    losses: u32,
}

impl Dsp3000Binary {
    /// Creates a parser for a gyro that sends this type with these sync bits.
    #[must_use]
    pub const fn new(mode: Mode, sync: u8) -> Self {
        Self { mode, sync: sync & 3, bytes: Vec::new(), good: 0, losses: 0 }
    }

    /// Processes one byte; returns a word if the byte completes a good one in an accepted phase.
    pub fn receive(&mut self, byte: u8) -> Option<Word> {
        // At most three bytes are kept between calls.
        let _ = self.bytes.push(byte);
        let bytes: [u8; 4] = self.bytes.as_slice().try_into().ok()?;
        match Word::parse(bytes) {
            Ok(word) if word.mode == self.mode && word.sync == self.sync => {
                self.bytes.clear();
                self.good = (self.good + 1).min(LOCK);
                (self.good == LOCK).then_some(word)
            }
            _ => {
                self.losses = self.losses.saturating_add(u32::from(self.good == LOCK));
                self.good = 0;
                self.bytes.remove(0);
                None
            }
        }
    }

    /// Drops an incomplete word; the next byte begins a word. Call it when the line has been silent for more than
    /// 0.3 ms, longer than a few bytes take.
    pub fn pause(&mut self) {
        if !self.bytes.is_empty() {
            self.losses = self.losses.saturating_add(u32::from(self.good == LOCK));
            self.good = 0;
            self.bytes.clear();
        }
    }

    /// Returns the number of times that an accepted phase was lost.
    #[must_use]
    pub fn losses(&self) -> u32 {
        self.losses
    }
}
