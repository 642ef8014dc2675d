//! Vehicle Direction/Speed of SAE J1939-71 (VDS, PGN 65256): SPN 165 compass bearing, SPN 517 navigation-based speed;
//! Vehicle Position (VP, PGN 65267): SPN 584 latitude.

use super::{Heading, HeadingError, group, word};
use embedded_can::Frame;

/// Parameter group of direction and speed.
pub const DIRECTION_SPEED: u32 = 65_256;
/// Parameter group of the position.
pub const POSITION: u32 = 65_267;
/// From here on a 16-bit code stands for a parameter's state, an error or no value (J1939-71, 5.1.4).
const STATES: u16 = 0xFB00;
/// The same of 32 bits.
const LONG_STATES: u32 = 0xFB00_0000;
/// Codes per radian: 1/128 deg.
const PER_RAD: f32 = 128.0 * 180.0 / core::f32::consts::PI;
/// Codes per m/s: 1/256 km/h.
const PER_SPEED: f32 = 256.0 * 3.6;

/// Reads bearing and speed; `None` for a frame of another group.
pub fn direction_speed(frame: &impl Frame) -> Option<Result<Heading, HeadingError>> {
    Some(group(frame, DIRECTION_SPEED)?.and_then(|[c0, c1, s0, s1, ..]| {
        let course = word([c0, c1], STATES).map(|code| code / PER_RAD);
        let speed = word([s0, s1], STATES).map(|code| code / PER_SPEED);
        Heading { course, speed, ..Heading::default() }.checked()
    }))
}

/// Reads the latitude, degrees, north positive; `None` for a frame of another group, `Ok(None)` where it is not available.
pub fn latitude(frame: &impl Frame) -> Option<Result<Option<f32>, HeadingError>> {
    Some(group(frame, POSITION)?.map(|[a, b, c, d, ..]| {
        let code = u32::from_le_bytes([a, b, c, d]);
        // 1e-7 deg per code, from -210 deg.
        (code < LONG_STATES).then(|| (f64::from(code) * 1e-7 - 210.0) as f32)
    }))
}
