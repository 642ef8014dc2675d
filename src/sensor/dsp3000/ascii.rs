//! Parses the variant of the DSP-3000 that sends lines of text.
//!
//! A line is a decimal number, blanks and `1` (valid) or `0` (fault), ended by CR and LF. Implementations differ in
//! the width of the line, so blanks are trimmed and the line end is the only framing. There is no checksum: a corrupt
//! digit gives a wrong number. Lines of any other form are refused, and the caller must also check
//! that a reading is plausible.

use super::Mode;
use crate::sample::FogSample;
use crate::units::Micros;
use core::fmt::Write;
use heapless::{String, Vec};

/// Size of the line buffer, bytes; longer than any line that the gyro sends.
pub const MAX_LINE: usize = 32;
/// Units of the last digit per deg or deg/s.
const MILLIONTHS: u32 = 1_000_000;

/// A number as the gyro sends it: deg/s, deg, or deg modulo 360, depending on [`super::Mode`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// Value in millionths of the unit, exact.
    pub millionths: i32,
    /// True if the gyro marks the reading as valid.
    pub valid: bool,
}

/// The reason why a line is not a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LineError {
    /// The line is not of the form `[-]ddd.dddddd y`.
    #[error("DSP-3000: the line is not a number and a validity flag")]
    Form,
    /// The line is longer than [`MAX_LINE`].
    #[error("DSP-3000: the line is too long")]
    TooLong,
}

impl Reading {
    /// Parses a line without its CR and LF.
    ///
    /// # Errors
    /// [`LineError::Form`].
    pub fn parse(line: &[u8]) -> Result<Self, LineError> {
        let line = line.trim_ascii();
        let (number, valid) = match line {
            [number @ .., b'1'] => (number, true),
            [number @ .., b'0'] => (number, false),
            _ => return Err(LineError::Form),
        };
        // At least one blank separates number and validity.
        let trimmed = number.trim_ascii_end();
        if trimmed.len() == number.len() {
            return Err(LineError::Form);
        }
        let (digits, sign) = trimmed.strip_prefix(b"-").map_or((trimmed, 1), |digits| (digits, -1));
        let point = digits.iter().position(|byte| *byte == b'.').ok_or(LineError::Form)?;
        let (whole, fraction) = digits.split_at_checked(point).ok_or(LineError::Form)?;
        let fraction = fraction.get(1..).filter(|fraction| fraction.len() == 6).ok_or(LineError::Form)?;
        if whole.is_empty() || whole.len() > 3 {
            return Err(LineError::Form);
        }
        let millionths = decimal(whole)? * MILLIONTHS + decimal(fraction)?;
        // Three digits before the point: below 10^9.
        Ok(Self { millionths: sign * millionths as i32, valid })
    }

    /// Creates the sample of a rate or increment that arrived at `now` and covers `span` microseconds. `None` for an
    /// integrated angle: set the gyro to increments instead.
    #[must_use]
    pub fn sample(&self, mode: Mode, now: Micros, span: u32) -> Option<FogSample> {
        super::sample(mode, self.millionths as f32 * 1e-6, self.valid, now, span)
    }

    /// Encodes the line with CR and LF; a number with more than three digits before the point is clamped to the
    /// largest one that fits.
    #[must_use]
    pub fn emit(&self) -> String<MAX_LINE> {
        let mut line = String::new();
        let magnitude = self.millionths.unsigned_abs().min(1_000 * MILLIONTHS - 1);
        let sign = if self.millionths < 0 { "-" } else { "" };
        let (whole, fraction) = (magnitude / MILLIONTHS, magnitude % MILLIONTHS);
        let _ = write!(line, "{sign}{whole}.{fraction:06} {}\r\n", u8::from(self.valid));
        line
    }
}

/// Parses at most six digits.
fn decimal(digits: &[u8]) -> Result<u32, LineError> {
    digits.iter().try_fold(0, |value, byte| match byte {
        b'0'..=b'9' => Ok(value * 10 + u32::from(byte - b'0')),
        _ => Err(LineError::Form),
    })
}

/// The parser: assembles lines from bytes and parses them.
#[derive(Debug, Clone, Default)]
pub struct Dsp3000Ascii {
    line: Vec<u8, MAX_LINE>,
    /// True if the current line is too long; it is ignored until it ends.
    too_long: bool,
}

impl Dsp3000Ascii {
    /// Creates a parser that has received nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: Vec::new(), too_long: false }
    }

    /// Processes one byte; if it ends a line, returns a reading or an error. Empty lines are skipped. The first line
    /// may be incomplete and still parse as a number: drop it if the gyro was already sending when the port was
    /// opened.
    pub fn receive(&mut self, byte: u8) -> Option<Result<Reading, LineError>> {
        if byte != b'\r' && byte != b'\n' {
            self.too_long |= self.line.push(byte).is_err();
            return None;
        }
        let result = if self.too_long {
            Some(Err(LineError::TooLong))
        } else if self.line.trim_ascii().is_empty() {
            None
        } else {
            Some(Reading::parse(&self.line))
        };
        self.line.clear();
        self.too_long = false;
        result
    }
}
