//! The words of the ASM330LHH's FIFO, 7 bytes each, little-endian. Only the tag has a check, its parity: a bit error in the
//! other bytes gives a wrong reading.
//!
//! | tag, bits 7-3 | bytes 1 to 6 |
//! |---|---|
//! | 1 | i16 rate x, y, z |
//! | 2 | i16 acceleration x, y, z |
//! | 3 | i16 temperature |
//! | 4 | u32 time, 25 us |
//!
//! Bits 2-1 of the tag number the outputs modulo 4, and bit 0 makes the number of ones even. Rate, acceleration and time of
//! one output have one number; [`Outputs`] puts them together, in whichever order they come.

use crate::sample::ImuSample;
use crate::sensor::spi;
use crate::units::{CentiCelsius, Micros};

pub const WORD: usize = 7;

/// deg/s and g of a count in the ranges of 250 deg/s and 16 g.
const DPS: f32 = 0.008_75;
const G: f32 = 0.000_488;
/// The count of 250 deg/s, from which a rate is saturated: a word holds more, and the data sheet promises nothing of it.
const RATE_END: u16 = 28_571;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    Rate([i16; 3]),
    Force([i16; 3]),
    /// Temperature, 1/256 deg C above 25.
    Temperature(i16),
    /// Time, 25 us.
    Time(u32),
}

/// A word: the number of its output, modulo 4, and what it holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Word(pub u8, pub Content);

impl Word {
    /// Parses a word; `None` if its tag is damaged or of another kind.
    pub fn parse(&[tag, ref data @ ..]: &[u8; WORD]) -> Option<Self> {
        let &[d0, d1, d2, d3, ..] = data;
        let content = match tag >> 3 {
            1 => Content::Rate(spi::vector(data)),
            2 => Content::Force(spi::vector(data)),
            3 => Content::Temperature(i16::from_le_bytes([d0, d1])),
            4 => Content::Time(u32::from_le_bytes([d0, d1, d2, d3])),
            _ => return None,
        };
        tag.count_ones().is_multiple_of(2).then_some(Self(tag >> 1 & 3, content))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Readings {
    pub rate: [i16; 3],
    pub force: [i16; 3],
    /// Time, 25 us, modulo 2^32.
    pub time: u32,
    /// Newest temperature, 1/256 deg C above 25.
    pub temperature: Option<i16>,
}

impl Readings {
    /// Converts the readings, taken at `time`, to the pipeline's units; `None` if one does not fit.
    pub fn sample(&self, time: Micros) -> Option<ImuSample> {
        let is_clipped = self.rate.iter().any(|n| n.unsigned_abs() >= RATE_END)
            || self.force.iter().any(|n| *n == i16::MAX || *n <= -i16::MAX);
        // Within -103 and 153 deg C.
        let temperature = self.temperature.map(|n| CentiCelsius((i32::from(n) * 25 / 64 + 2_500) as i16));
        let (g, dps) = (self.force.map(|n| f32::from(n) * G), self.rate.map(|n| f32::from(n) * DPS));
        spi::sample(time, g, dps, temperature, is_clipped)
    }
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Outputs {
    number: u8,
    rate: Option<[i16; 3]>,
    force: Option<[i16; 3]>,
    time: Option<u32>,
    /// Newest temperature, 1/256 deg C above 25.
    pub temperature: Option<i16>,
}

impl Outputs {
    /// Adds a word; returns the readings that it completes. An output that lacks a word is an error.
    pub fn add(&mut self, Word(number, content): Word) -> Result<Option<Readings>, Incomplete> {
        let is_next = number != self.number;
        let was_begun = self.rate.is_some() || self.force.is_some() || self.time.is_some();
        if is_next {
            self.restart();
            self.number = number;
        }
        match content {
            Content::Rate(rate) => self.rate = Some(rate),
            Content::Force(force) => self.force = Some(force),
            Content::Time(time) => self.time = Some(time),
            Content::Temperature(temperature) => self.temperature = Some(temperature),
        }
        if is_next && was_begun {
            return Err(Incomplete);
        }
        let Self { rate: Some(rate), force: Some(force), time: Some(time), temperature, .. } = *self else {
            return Ok(None);
        };
        self.restart();
        Ok(Some(Readings { rate, force, time, temperature }))
    }

    pub fn restart(&mut self) {
        (self.rate, self.force, self.time) = (None, None, None);
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incomplete;
