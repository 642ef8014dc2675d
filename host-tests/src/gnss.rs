//! Bytes of GNSS receivers, made by the pages of their protocols: UBX-NAV-PVT and sentences of NMEA 0183.

use crate::wire::{data_frame, id11};
use gyronet::can::DataFrame;
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::heading::{GnssSettings, HeadingSettings, HeadingSignal};

/// What a NAV-PVT message says, in its own units.
#[derive(Debug, Clone, Copy)]
pub struct Pvt {
    /// 0 none, 1 reckoned, 2 and 3 by satellites, 4 by both.
    pub fix: u8,
    /// Bit 0: the fix is within its limits.
    pub flags: u8,
    /// 1e-7 deg.
    pub latitude: i32,
    /// mm/s, and its accuracy.
    pub speed: i32,
    pub speed_sigma: u32,
    /// 1e-5 deg, and its accuracy.
    pub course: i32,
    pub course_sigma: u32,
    /// Bit 0: the position is not valid.
    pub more_flags: u8,
}

impl Pvt {
    /// South-southwest at 36 km/h, in Zurich.
    pub const GOOD: Self = Self {
        fix: 3,
        flags: 1,
        latitude: 473_769_000,
        speed: 10_000,
        speed_sigma: 150,
        course: 21_000_000,
        course_sigma: 80_000,
        more_flags: 0,
    };

    pub fn bytes(&self) -> Vec<u8> {
        let mut payload = [0; 92];
        let mut put = |at: usize, bytes: &[u8]| payload[at..at + bytes.len()].copy_from_slice(bytes);
        put(20, &[self.fix, self.flags]);
        put(28, &self.latitude.to_le_bytes());
        put(60, &self.speed.to_le_bytes());
        put(64, &self.course.to_le_bytes());
        put(68, &self.speed_sigma.to_le_bytes());
        put(72, &self.course_sigma.to_le_bytes());
        put(78, &[self.more_flags]);
        ubx([0x01, 0x07], &payload)
    }

    /// The same numbers in frames, as [`sources`] describes them.
    pub fn frames(&self) -> [DataFrame; 2] {
        let speed = [self.speed as u32, self.speed_sigma];
        let course = [self.course as u32, self.course_sigma];
        [(SPEED, speed), (COURSE, course)]
            .map(|(id, words)| data_frame(id11(id), words.map(u32::to_le_bytes).as_flattened()))
    }
}

const COURSE: u16 = 0x321;
const SPEED: u16 = 0x322;

/// The settings of a receiver on its line, and those of the same numbers in frames.
pub fn sources(line: GnssSettings) -> [HeadingSettings; 2] {
    let signal = |id, start, factor| {
        let id = id11(id);
        let field = BitField::new(start, 32, ByteOrder::Intel, false).expect("inside the frame");
        Some(HeadingSignal { id, field, factor, offset: 0.0, invalid: None })
    };
    let rad = 1e-5 * std::f32::consts::PI / 180.0;
    [
        HeadingSettings { line: Some(line), ..HeadingSettings::NONE },
        HeadingSettings {
            course: signal(COURSE, 0, rad),
            course_sigma: signal(COURSE, 32, rad),
            speed: signal(SPEED, 0, 1e-3),
            speed_sigma: signal(SPEED, 32, 1e-3),
            ..HeadingSettings::NONE
        },
    ]
}

/// A frame of a class and number.
pub fn ubx(message: [u8; 2], payload: &[u8]) -> Vec<u8> {
    let length = (payload.len() as u16).to_le_bytes();
    let body = [&message[..], &length, payload].concat();
    let (mut a, mut b) = (0u8, 0u8);
    for byte in &body {
        a = a.wrapping_add(*byte);
        b = b.wrapping_add(a);
    }
    [&[0xB5, 0x62], &body[..], &[a, b]].concat()
}

/// A sentence of what is between `$` and `*`.
pub fn sentence(body: &str) -> Vec<u8> {
    let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${body}*{sum:02X}\r\n").into_bytes()
}
