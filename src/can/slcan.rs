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
const STAMP_MODULUS: u64 = 60_000;

/// Encodes a frame as `tIIILDD..` or, extended, `TIIIIIIIILDD..` and CR; `None` if it is no classic data frame.
pub fn emit(frame: &impl Frame) -> Option<Line> {
    let mut text = [0; MAX_STAMPED_LINE];
    let length = encode(frame, None, &mut text)?;
    Line::from_slice(text.get(..length)?).ok()
}

/// Writes a frame as [`emit`], with a time stamp of four digits if wanted (`Z1`); returns its length.
#[doc(hidden)]
pub fn encode(frame: &impl Frame, time: Option<Micros>, text: &mut [u8; MAX_STAMPED_LINE]) -> Option<usize> {
    let data = frame.data();
    if frame.is_remote_frame() || data.len() > 8 {
        return None;
    }
    let [_, length] = hex(data.len() as u8);
    let head = match frame.id() {
        Id::Standard(id) => {
            let ([_, first], [second, third]) = (hex((id.as_raw() >> 8) as u8), hex(id.as_raw() as u8));
            text[..5].copy_from_slice(&[b't', first, second, third, length]);
            5
        }
        Id::Extended(id) => {
            let digits = id.as_raw().to_be_bytes().map(hex);
            text[0] = b'T';
            text[1..9].copy_from_slice(digits.as_flattened());
            text[9] = length;
            10
        }
    };
    let pairs = text.get_mut(head..)?.as_chunks_mut().0;
    pairs.iter_mut().zip(data).for_each(|(pair, byte)| *pair = hex(*byte));
    let mut length = head + 2 * data.len();
    if let Some(time) = time {
        let stamp = (time.0 / 1000 % STAMP_MODULUS) as u16;
        let digits = stamp.to_be_bytes().map(hex);
        text.get_mut(length..length + 4)?.copy_from_slice(digits.as_flattened());
        length += 4;
    }
    *text.get_mut(length)? = b'\r';
    Some(length + 1)
}

/// Encodes a byte as two hexadecimal digits, both at once: a board encodes thousands of bytes a second.
#[inline]
pub(crate) fn hex(byte: u8) -> [u8; 2] {
    let digits = u16::from(byte >> 4) | u16::from(byte & 0xF) << 8;
    // One where a digit is above 9: the letters begin 7 behind the character behind '9'.
    let letters = (digits + 0x0606) >> 4 & 0x0101;
    (digits + 0x3030 + 7 * letters).to_le_bytes()
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

/// Parses a line with a time stamp, without its CR, and returns the frame and the time stamp in milliseconds.
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
