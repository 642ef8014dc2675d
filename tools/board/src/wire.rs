//! CAN frames and bytes of an Xsens MTi, and the samples that a part's driver delivers for bytes.

use embedded_can::{ExtendedId, Frame, Id, StandardId};
use gyronet::can::DataFrame;
use gyronet::sample::ImuSample;
use gyronet::sensor::ByteSource;
use gyronet::sensor::xsens::{MtData2, Mti, XsensError};
use gyronet_tools::drive::wheel_frames;
use std::borrow::Borrow;

pub const fn id11(raw: u16) -> Id {
    Id::Standard(StandardId::new(raw).expect("11 bits"))
}

pub const fn id29(raw: u32) -> Id {
    Id::Extended(ExtendedId::new(raw).expect("29 bits"))
}

/// An identifier of 11 bits; [`u16::MAX`] for one of 29.
pub fn raw(frame: &DataFrame) -> u16 {
    match frame.id() {
        Id::Standard(id) => id.as_raw(),
        Id::Extended(_) => u16::MAX,
    }
}

pub fn data_frame(id: Id, data: &[u8]) -> DataFrame {
    DataFrame::new(id, data).expect("at most eight bytes")
}

/// NMEA 2000's rapid update of a course, rad clockwise from north, and a speed, m/s.
pub fn course([course, speed]: [Option<f32>; 2], sequence: u8) -> DataFrame {
    let code = |value: Option<f32>, per: f32| {
        value.map_or(u16::MAX, |value| (value * per).round() as u16).to_le_bytes()
    };
    let ([c0, c1], [s0, s1]) = (code(course, 1e4), code(speed, 100.0));
    data_frame(id29(0x09F8_0223), &[sequence, 0xFC, c0, c1, s0, s1, 0xFF, 0xFF])
}

/// Bytes in hexadecimal, with or without spaces between them.
pub fn bytes(hex: &str) -> Vec<u8> {
    let digits: String = hex.split_whitespace().collect();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hex");
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// A frame of a real MTi with 98 bytes of payload.
pub fn real_frame() -> Vec<u8> {
    bytes(
        "fa ff 36 62 10 20 02 a9 86 10 60 04 03 14 ed 53 10 10 0c 07 44 0b e0 07 e3 01 14 0d 2f 18 37 e0 20 04 01 \
         80 00 07 40 20 0c bc 8e 54 66 c0 e8 2f 10 bf 9a d2 9e 40 10 0c b9 35 26 9f bd 94 99 30 bc 46 23 46 80 20 \
         0c bb 42 5c 34 3b 10 68 df 3a e1 c7 e5 80 30 10 3f 80 00 01 b7 78 c7 f0 37 38 d8 27 37 10 7f ee f7",
    )
}

/// A made-up frame: az 9.81 m/s^2, gz 10 deg/s, counter 1, time 100, status 3.
pub fn synthetic_frame() -> Vec<u8> {
    bytes(
        "fa ff 36 31 10 20 02 00 01 10 60 04 00 00 00 64 40 20 0c 00 00 00 00 00 00 00 00 41 1c f5 c3 80 20 0c 00 \
         00 00 00 00 00 00 00 3e 32 b8 c2 e0 20 04 00 00 00 03 71",
    )
}

/// A message whose readings differ with its time (10 kHz).
pub fn message(time: u32) -> MtData2 {
    MtData2 {
        packet_counter: Some(time as u16),
        sample_time_fine: Some(time),
        acceleration: Some([0.5, -0.25, 9.81]),
        rate_of_turn: Some([0.0, 0.125, (time % 1_000) as f32 * 1e-3]),
        temperature: None,
        status: Some(3),
    }
}

/// Results of a part's driver for these bytes.
pub fn feed<P: ByteSource>(
    part: &mut P,
    bytes: impl IntoIterator<Item = impl Borrow<u8>>,
) -> Vec<Result<P::Sample, P::Error>> {
    let mut samples = Vec::new();
    for byte in bytes {
        part.receive(*byte.borrow());
        samples.extend(std::iter::from_fn(|| part.next_sample()));
    }
    samples
}

pub fn feed_new(bytes: impl IntoIterator<Item = u8>) -> Vec<Result<ImuSample, XsensError>> {
    feed(&mut Mti::new(), bytes)
}

/// The frame of wheels that all turn at this speed, km/h.
pub fn wheels(speed: f64) -> DataFrame {
    wheel_frames::frame([Some(speed); 4]).expect("a frame")
}
