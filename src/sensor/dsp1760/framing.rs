//! Finds DSP-1760 messages in a byte stream, by header and CRC.

use super::message::{CRC_32_MPEG_2, Format};
use crate::sensor::framer::Protocol;

/// The framing of data messages and built-in-test messages.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kvh;

/// Returns whether a frame is a built-in-test message: FE 81 00, sent at power-up and on request.
pub(super) fn is_self_test(frame: &[u8]) -> bool {
    frame.get(2) == Some(&0x00)
}

/// Returns the length of a built-in-test message without its checksum, whose algorithm is unknown: that byte is
/// skipped, so that a corrupt message cannot take the first byte of an intact one.
const fn bit_length(kind: u8) -> Option<usize> {
    match kind {
        0xAA => Some(4 + 6),
        0xAB => Some(4 + 8),
        _ => None,
    }
}

impl Protocol for Kvh {
    const HEADER: usize = 4;

    fn length(header: &[u8]) -> Option<usize> {
        match *header {
            [0xFE, 0x81, 0x00, kind] => bit_length(kind),
            [b0, b1, b2, b3] => Format::of([b0, b1, b2, b3]).map(Format::length),
            _ => None,
        }
    }

    fn check(frame: &[u8]) -> bool {
        match frame {
            // Status bytes have seven bits each, so they cannot contain a header.
            [_, _, _, _, status @ ..] if is_self_test(frame) => status.iter().all(|byte| byte & 0x80 == 0),
            _ => CRC_32_MPEG_2.checksum(frame) == 0,
        }
    }
}
