//! Rapid updates of position and of course and speed over ground of NMEA 2000 (PGN 129025 and 129026), by the
//! definitions of canboat.

use super::{Heading, HeadingError, group, word};
use embedded_can::Frame;

/// Parameter group of the position.
pub const POSITION: u32 = 129_025;
/// Parameter group of course and speed.
pub const COURSE_SPEED: u32 = 129_026;
/// From here on a 16-bit code is reserved, an error or not available.
const RESERVED: u16 = 0xFFFD;
/// The same of 32 bits with sign.
const LONG_RESERVED: i32 = i32::MAX - 2;
/// Codes per radian, and per m/s.
const PER_RAD: f32 = 1e4;
const PER_SPEED: f32 = 100.0;

/// Reads course and speed; `None` for another group. A course from magnetic north is refused.
pub fn course_speed(frame: &impl Frame) -> Option<Result<Heading, HeadingError>> {
    Some(group(frame, COURSE_SPEED)?.and_then(|[_sequence, reference, c0, c1, s0, s1, ..]| {
        let course = word([c0, c1], RESERVED).map(|code| code / PER_RAD);
        let speed = word([s0, s1], RESERVED).map(|code| code / PER_SPEED);
        match reference & 3 {
            0 => Heading { course, speed, ..Heading::default() }.checked(),
            _ if course.is_none() => Heading { speed, ..Heading::default() }.checked(),
            other => Err(HeadingError::Reference(other)),
        }
    }))
}

/// Reads a latitude, degrees, north positive; `None` for another group, `Ok(None)` where it is not available.
pub fn latitude(frame: &impl Frame) -> Option<Result<Option<f32>, HeadingError>> {
    Some(group(frame, POSITION)?.map(|[a, b, c, d, ..]| {
        let code = i32::from_le_bytes([a, b, c, d]);
        (code < LONG_RESERVED).then_some(code as f32 * 1e-7)
    }))
}
