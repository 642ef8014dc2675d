//! Where messages of the DSP-1760 begin and end in its bytes.

use super::message::Format;
use crate::sensor::crc::CRC_32_MPEG_2;
use crate::sensor::framer::{Candidate, Protocol};

/// The framing: data messages, and the built-in-test messages among them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kvh;

/// Header of a built-in-test message, sent at power-up and on request; its long form is one
/// more, with eight status bytes instead of six.
pub(super) const BIT_HEADER: [u8; 3] = [0xFE, 0x81, 0x00];

/// Header and status of a built-in-test message, checksum left out: its rule is not known.
/// So the byte behind is passed over like any other that begins no frame, and a damaged
/// message of this kind cannot take the first byte of an intact one with it.
const fn bit_length(kind: u8) -> Option<usize> {
    match kind {
        0xAA => Some(4 + 6),
        0xAB => Some(4 + 8),
        _ => None,
    }
}

impl Protocol for Kvh {
    fn candidate(bytes: &[u8]) -> Candidate {
        let len = match *bytes {
            [0xFE] | [0xFE, 0x81] | [0xFE, 0x81, 0xFF | 0x00] => return Candidate::Incomplete,
            [b0, b1, b2, kind, ..] if [b0, b1, b2] == BIT_HEADER => bit_length(kind),
            [b0, b1, b2, b3, ..] => Format::of([b0, b1, b2, b3]).map(Format::length),
            _ => None,
        };
        match len {
            None => Candidate::No,
            Some(len) if bytes.len() < len => Candidate::Incomplete,
            Some(len) => Candidate::Frame(len),
        }
    }

    fn check(frame: &[u8]) -> bool {
        match frame.strip_prefix(&BIT_HEADER) {
            // Seven bits each: no header can hide in them.
            Some([_, status @ ..]) => status.iter().all(|byte| byte & 0x80 == 0),
            _ => CRC_32_MPEG_2.checksum(frame) == 0,
        }
    }
}
