//! UBX-NAV-PVT of u-blox receivers of generation 8 and later (u-blox M8 protocol specification, UBX-13003221).
//!
//! A frame is `B5 62 CLASS ID LENGTH PAYLOAD CK_A CK_B`; the checksum is Fletcher's of eight bits over what lies between
//! the first two bytes and itself. Its numbers are little-endian.

use super::{Fix, Heading, HeadingError, Read};
use crate::sensor::framer::Protocol;
use core::f32::consts::PI;

const SYNC: [u8; 2] = [0xB5, 0x62];
const NAV_PVT: [u8; 2] = [0x01, 0x07];
const PAYLOAD: usize = 92;
const HEADER: usize = 6;
/// Length of the longest frame that is read, bytes: that of NAV-PVT. What claims to be longer is searched for headers.
pub(super) const MAX_FRAME: usize = HEADER + PAYLOAD + 2;
/// Units of a course, 1e-5 deg, in rad; of a speed, mm/s, in m/s; of a latitude in degrees.
const COURSE: f32 = 1e-5 * PI / 180.0;
const SPEED: f32 = 1e-3;
const LATITUDE: f32 = 1e-7;

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ubx;

impl Protocol for Ubx {
    const HEADER: usize = HEADER;

    fn length(header: &[u8]) -> Option<usize> {
        let [a, b, _, _, low, high] = *header.first_chunk()?;
        ([a, b] == SYNC).then(|| HEADER + usize::from(u16::from_le_bytes([low, high])) + 2)
    }

    fn check(frame: &[u8]) -> bool {
        let Some((body, sum)) = frame.split_last_chunk::<2>() else { return false };
        let fletcher = body.iter().skip(SYNC.len()).fold([0u8; 2], |[a, b], byte| {
            let a = a.wrapping_add(*byte);
            [a, b.wrapping_add(a)]
        });
        fletcher == *sum
    }
}

pub(super) fn read(frame: &[u8]) -> Read {
    let [_, _, class, id, _, _, payload @ .., _, _] = frame else { return None };
    let of_this_version = || payload.try_into().map_err(|_| HeadingError::Length(payload.len()));
    ([*class, *id] == NAV_PVT).then(|| of_this_version().and_then(nav_pvt))
}

fn nav_pvt(payload: &[u8; PAYLOAD]) -> Result<Fix, HeadingError> {
    // Both are in range.
    let byte = |at: usize| payload.get(at).copied().unwrap_or_default();
    let word = |at| i32::from_le_bytes([byte(at), byte(at + 1), byte(at + 2), byte(at + 3)]);
    let unsigned = |at| word(at) as u32 as f32;
    match (byte(20), byte(21) & 1 != 0) {
        // By its own gyro, alone or with satellites.
        (1 | 4, _) => Err(HeadingError::Reckoned),
        (2 | 3, true) => {
            let course = word(64) as f32 * COURSE;
            let heading = Heading {
                course: Some(if course < 0.0 { course + 2.0 * PI } else { course }),
                course_sigma: Some(unsigned(72) * COURSE),
                speed: Some(word(60) as f32 * SPEED),
                speed_sigma: Some(unsigned(68) * SPEED),
            };
            let is_placed = byte(78) & 1 == 0;
            Ok(Fix { heading: Some(heading), latitude: Ok(is_placed.then(|| word(28) as f32 * LATITUDE)) })
        }
        _ => Ok(Fix::NONE),
    }
}
