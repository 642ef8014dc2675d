//! SLCAN carries CAN frames over a serial line in the Lawicel format (CAN232 manual): one line of ASCII per frame.

#[doc(hidden)]
pub mod assembler;
#[doc(hidden)]
pub mod host;
pub mod port;

use crate::units::Micros;
use embedded_can::{Frame, Id};
use heapless::Vec;

/// Longest line: `T`, eight digits of identifier, length, sixteen digits of data, CR.
pub const MAX_LINE: usize = 27;
/// An encoded frame.
pub type Line = Vec<u8, MAX_LINE>;

/// Longest line with a time stamp of four digits.
pub const MAX_STAMPED_LINE: usize = MAX_LINE + 4;
/// An encoded frame with a time stamp.
pub type StampedLine = Vec<u8, MAX_STAMPED_LINE>;
/// Time stamps are milliseconds modulo one minute.
const STAMP_MODULUS: u64 = 60_000;

const DIGITS: &[u8; 16] = b"0123456789ABCDEF";

/// Encodes a frame as `tIIILDD..` for a standard identifier or `TIIIIIIIILDD..` for an extended one, with CR at the
/// end.
///
/// Returns `None` for a frame that is not a classic data frame (remote, or more than eight bytes).
pub fn emit(frame: &impl Frame) -> Option<Line> {
    if frame.is_remote_frame() || frame.data().len() > 8 {
        return None;
    }
    let (letter, id, digits) = match frame.id() {
        Id::Standard(id) => (b't', u32::from(id.as_raw()), 3),
        Id::Extended(id) => (b'T', id.as_raw(), 8),
    };
    let mut line = Line::new();
    line.push(letter).ok()?;
    for k in (0..digits).rev() {
        line.push(DIGITS[(id >> (4 * k)) as usize & 0xF]).ok()?;
    }
    line.push(DIGITS[frame.dlc() & 0xF]).ok()?;
    for byte in frame.data() {
        line.extend_from_slice(&hex(*byte)).ok()?;
    }
    line.push(b'\r').ok()?;
    Some(line)
}

/// Encodes a frame as [`emit`] does, followed by a time stamp of four hexadecimal digits: milliseconds modulo one
/// minute. A host enables time stamps with `Z1`.
pub fn emit_stamped(frame: &impl Frame, time: Micros) -> Option<StampedLine> {
    let line = emit(frame)?;
    let (_, frame) = line.split_last()?;
    let mut stamped = StampedLine::from_slice(frame).ok()?;
    let stamp = (time.0 / 1000 % STAMP_MODULUS) as u16;
    for byte in stamp.to_be_bytes() {
        stamped.extend_from_slice(&hex(byte)).ok()?;
    }
    stamped.push(b'\r').ok()?;
    Some(stamped)
}

/// Encodes a byte as two hexadecimal digits.
fn hex(byte: u8) -> [u8; 2] {
    [DIGITS[usize::from(byte >> 4)], DIGITS[usize::from(byte & 0xF)]]
}

/// The reason why a line is not a data frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "its messages say it")]
pub enum SlcanError {
    #[error("not a data frame line")]
    Kind,
    #[error("not a hexadecimal digit at column {at}")]
    Digit { at: usize },
    #[error("line length does not match the frame")]
    Length,
    #[error("identifier out of range")]
    Identifier,
}

/// Parses a line with a time stamp, without its CR, and returns the frame and the time stamp in
/// milliseconds.
///
/// # Errors
/// [`SlcanError`] for a line that is not a data frame with a time stamp.
pub fn parse_stamped<F: Frame>(line: &[u8]) -> Result<(F, u16), SlcanError> {
    let at = line.len().saturating_sub(4);
    let (line, digits) = line.split_at(at);
    let mut stamp = 0;
    for (k, c) in digits.iter().enumerate() {
        let digit = char::from(*c).to_digit(16).ok_or(SlcanError::Digit { at: at + k })?;
        stamp = stamp << 4 | digit as u16;
    }
    Ok((parse(line)?, stamp))
}

/// Parses a data frame line, without its CR.
///
/// # Errors
/// [`SlcanError`] for a line that is not a data frame.
pub fn parse<F: Frame>(line: &[u8]) -> Result<F, SlcanError> {
    let digits = match line.first() {
        Some(b't') => 3,
        Some(b'T') => 8,
        _ => return Err(SlcanError::Kind),
    };
    let digit = |at: usize| {
        let c = *line.get(at).ok_or(SlcanError::Length)?;
        char::from(c).to_digit(16).ok_or(SlcanError::Digit { at })
    };
    let mut raw = 0;
    for at in 1..=digits {
        raw = raw << 4 | digit(at)?;
    }
    let len = digit(digits + 1)? as usize;
    if len > 8 || line.len() != digits + 2 + 2 * len {
        return Err(SlcanError::Length);
    }
    let mut data = [0; 8];
    for (k, byte) in data.iter_mut().enumerate().take(len) {
        let at = digits + 2 + 2 * k;
        *byte = (digit(at)? << 4 | digit(at + 1)?) as u8;
    }
    let id = if digits == 3 {
        embedded_can::StandardId::new(raw as u16).map(Id::Standard)
    } else {
        embedded_can::ExtendedId::new(raw).map(Id::Extended)
    };
    F::new(id.ok_or(SlcanError::Identifier)?, &data[..len]).ok_or(SlcanError::Length)
}
