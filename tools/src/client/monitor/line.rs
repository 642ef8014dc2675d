//! Parses CAN frames from text: SLCAN lines, with or without time stamps, and `candump -L` logs.

use embedded_can::{ExtendedId, Frame, Id, StandardId};
use gyronet::can::{DataFrame, slcan};

/// Longest line that is read; a log's line with eight data bytes has about 50 characters.
const MAX_LINE: usize = 128;

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("neither an SLCAN line nor a line of a candump log")]
pub struct NoFrame;

/// Parses one line. The time stamp is in seconds: a log's own, or SLCAN's, which wraps every minute.
pub fn parse_line(line: &str) -> Result<(Option<f64>, DataFrame), NoFrame> {
    let line = line.trim();
    if let Some(rest) = line.strip_prefix('(') {
        return candump(rest).ok_or(NoFrame);
    }
    let line = line.as_bytes();
    if let Ok(frame) = slcan::parse(line) {
        return Ok((None, frame));
    }
    let (frame, ms) = slcan::parse_stamped(line).map_err(|_| NoFrame)?;
    Ok((Some(f64::from(ms) / 1000.0), frame))
}

/// Parses `seconds) interface ID#DATA`; an identifier with eight digits is extended.
fn candump(rest: &str) -> Option<(Option<f64>, DataFrame)> {
    let (time, rest) = rest.split_once(')')?;
    let (id, digits) = rest.split_whitespace().nth(1)?.split_once('#')?;
    let raw = u32::from_str_radix(id, 16).ok()?;
    let id = match id.len() {
        3 => Id::Standard(StandardId::new(u16::try_from(raw).ok()?)?),
        8 => Id::Extended(ExtendedId::new(raw)?),
        _ => return None,
    };
    if digits.len() % 2 != 0 || !digits.is_ascii() {
        return None;
    }
    let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let data: Vec<u8> = (0..digits.len()).step_by(2).map(byte).collect::<Option<_>>()?;
    Some((Some(time.parse().ok()?), DataFrame::new(id, &data)?))
}

/// Splits bytes into lines. CR, LF and BEL (SLCAN's "no") end a line; a line that is too long is cut off.
#[derive(Debug, Clone, Default)]
pub struct Splitter {
    line: Vec<u8>,
    too_long: bool,
}

impl Splitter {
    /// Accepts a byte and returns the line that it ends, unless that line is empty.
    pub fn feed(&mut self, byte: u8) -> Option<String> {
        if !matches!(byte, b'\r' | b'\n' | 7) {
            self.too_long |= self.line.len() == MAX_LINE;
            if !self.too_long {
                self.line.push(byte);
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        // The beginning of a line that is too long is enough to see that it is not a frame.
        self.too_long = false;
        (!line.is_empty()).then(|| String::from_utf8_lossy(&line).into_owned())
    }
}
