//! An Xbus frame is `FA FF MID LEN DATA.. CS`; all bytes after FA add up to 0 modulo 256.

use crate::sensor::framer::Protocol;
use heapless::Vec;

const PREAMBLE: u8 = 0xFA;
const BUS_ID: u8 = 0xFF;
/// Value of LEN that marks an extended length, which no message here needs.
const EXTENDED_LENGTH: u8 = 0xFF;
/// Bytes of a frame in addition to its data.
const OVERHEAD: usize = 5;
/// Length of the longest frame, bytes.
pub const MAX_FRAME: usize = 254 + OVERHEAD;

/// The framing of Xbus messages.
#[derive(Debug, Clone, Copy, Default)]
pub struct Xbus;

impl Protocol for Xbus {
    const HEADER: usize = 4;

    fn length(header: &[u8]) -> Option<usize> {
        match *header {
            [PREAMBLE, BUS_ID, _, len] if len != EXTENDED_LENGTH => Some(usize::from(len) + OVERHEAD),
            _ => None,
        }
    }

    fn check(frame: &[u8]) -> bool {
        frame.iter().skip(1).fold(0u8, |sum, byte| sum.wrapping_add(*byte)) == 0
    }
}

/// Returns the message identifier and the data of an intact frame.
#[must_use]
pub fn parse(frame: &[u8]) -> Option<(u8, &[u8])> {
    match frame {
        [PREAMBLE, BUS_ID, mid, len, data @ .., _] if usize::from(*len) == data.len() => {
            Xbus::check(frame).then_some((*mid, data))
        }
        _ => None,
    }
}

/// Encodes the frame of a message; `None` if it is longer than `N` bytes or than an Xbus frame.
#[must_use]
pub fn emit<const N: usize>(mid: u8, data: &[u8]) -> Option<Vec<u8, N>> {
    let len = u8::try_from(data.len()).ok().filter(|len| *len != EXTENDED_LENGTH)?;
    let mut frame = Vec::new();
    frame.extend_from_slice(&[PREAMBLE, BUS_ID, mid, len]).ok()?;
    frame.extend_from_slice(data).ok()?;
    let sum = frame.iter().skip(1).fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    frame.push(sum.wrapping_neg()).ok()?;
    Some(frame)
}
