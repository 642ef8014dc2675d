//! Rapid updates of position and of course and speed over ground of NMEA 2000 (PGN 129025 and 129026), by the
//! definitions of canboat.

use super::{Heading, HeadingError, Position, code, group, group_id, word};
use embedded_can::Frame;

/// Parameter group of the position.
pub const POSITION: u32 = 129_025;
/// Parameter group of course and speed.
pub const COURSE_SPEED: u32 = 129_026;
/// Priority of both.
const PRIORITY: u8 = 2;
/// From here on a 16-bit code is reserved, an error or not available.
const RESERVED: u16 = 0xFFFD;
/// Codes per radian, and per m/s.
const PER_RAD: f32 = 1e4;
const PER_SPEED: f32 = 100.0;
const DEG_PER_CODE: f64 = 1e-7;

/// Reads course and speed; `None` for a frame of another group.
///
/// # Errors
/// [`HeadingError`]; a course from magnetic north is refused, because the declination is not known.
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

/// Makes a frame with course and speed; accuracies have no place in it.
#[must_use]
pub fn course_speed_frame<F: Frame>(heading: &Heading, sequence: u8, source: u8) -> Option<F> {
    let [c0, c1] = code(heading.course, PER_RAD, u16::MAX);
    let [s0, s1] = code(heading.speed, PER_SPEED, u16::MAX);
    F::new(group_id(COURSE_SPEED, PRIORITY, source)?, &[sequence, 0xFC, c0, c1, s0, s1, 0xFF, 0xFF])
}

/// Reads a position; `None` for a frame of another group, `Ok(None)` where it is not available.
///
/// # Errors
/// [`HeadingError`].
pub fn position(frame: &impl Frame) -> Option<Result<Option<Position>, HeadingError>> {
    Some(group(frame, POSITION)?.and_then(|[a0, a1, a2, a3, o0, o1, o2, o3]| {
        let [latitude, longitude] = [[a0, a1, a2, a3], [o0, o1, o2, o3]].map(i32::from_le_bytes);
        if latitude >= i32::MAX - 2 || longitude >= i32::MAX - 2 {
            return Ok(None);
        }
        let [latitude_deg, longitude_deg] = [latitude, longitude].map(|code| f64::from(code) * DEG_PER_CODE);
        for (what, value, most) in [("latitude", latitude_deg, 90.0), ("longitude", longitude_deg, 180.0)] {
            if value.abs() > most {
                return Err(HeadingError::Range { what, value: value as f32 });
            }
        }
        Ok(Some(Position { latitude_deg, longitude_deg }))
    }))
}

/// Makes a frame with a position.
#[must_use]
pub fn position_frame<F: Frame>(position: &Position, source: u8) -> Option<F> {
    let code = |degrees: f64| (libm::round(degrees / DEG_PER_CODE) as i32).to_le_bytes();
    let ([a0, a1, a2, a3], [o0, o1, o2, o3]) = (code(position.latitude_deg), code(position.longitude_deg));
    F::new(group_id(POSITION, PRIORITY, source)?, &[a0, a1, a2, a3, o0, o1, o2, o3])
}
