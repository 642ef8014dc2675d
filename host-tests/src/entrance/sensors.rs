//! The parsers of the sensors.

use crate::gnss::{Pvt, sentence};
use crate::wire::feed;
use gyronet::heading::{GnssLine, GnssProtocol};
use gyronet::sensor::asm330lhh::word::{Outputs, WORD, Word};
use gyronet::sensor::bmi088::frame::{self, FORCE_FRAME, STATE, State};
use gyronet::sensor::dsp1760::Dsp1760;
use gyronet::sensor::dsp1760::message::CRC_32_MPEG_2;
use gyronet::sensor::dsp1760::message::Message;
use gyronet::sensor::icm42688::packet::{PACKET, Packet};
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::sensor::{ByteSource, spi};
use gyronet::units::Micros;
use std::fmt::Debug;

/// Passes bytes as a stream: received several at a time, they give the same samples as one by one.
fn stream<P: ByteSource>(new: fn() -> P, receive_some: fn(&mut P, &[u8]) -> usize, data: &[u8])
where
    P::Sample: Debug,
{
    let samples = feed(&mut new(), data);
    let (mut rest, mut part, mut again) = (data, new(), Vec::new());
    while !rest.is_empty() {
        rest = &rest[receive_some(&mut part, rest)..];
        again.extend(core::iter::from_fn(|| part.next_sample()));
    }
    assert_eq!(format!("{again:?}"), format!("{samples:?}"));
}

pub fn xsens(data: &[u8]) {
    stream(Mti::new, Mti::receive_some, data);
    if let Ok(message) = MtData2::parse(data) {
        // Bytes are compared, because NaN is not equal to itself.
        let frame = message.emit();
        let again = MtData2::parse(&frame[4..frame.len() - 1]).expect("an emitted message");
        assert_eq!(again.emit(), frame);
    }
}

/// Passes bytes as a stream, as a message, and as a message with a valid checksum.
pub fn dsp1760(data: &[u8]) {
    stream(Dsp1760::new, Dsp1760::receive_some, data);
    let mut frame = data.to_vec();
    frame.extend(CRC_32_MPEG_2.checksum(data).to_be_bytes());
    for frame in [data, &frame] {
        if let Ok(message) = Message::parse(frame) {
            let again = Message::parse(&message.emit()).expect("an emitted message");
            assert_eq!(again.emit(), message.emit());
        }
    }
}

/// Passes bytes as a stream in both protocols, and checks that a good message behind them and what a header among them may
/// announce is read, at the latest once a talker among them is silent.
pub fn gnss(data: &[u8]) {
    let good =
        [(GnssProtocol::Ubx, Pvt::GOOD.bytes()), (GnssProtocol::Nmea, sentence("GPRMC,,A,,,,,,210.0,,,,A"))];
    for (protocol, good) in good {
        let fixes = feed(&mut GnssLine::new(protocol), [data, &[0; 100], &good.repeat(51)].concat());
        assert!(fixes.last().is_some_and(Result::is_ok), "{protocol:?}");
    }
}

/// Passes bytes as the state of the accelerometer, a frame of its FIFO and a frame of the gyro's: all readings are in range.
pub fn bmi088(data: &[u8]) {
    let (samples, _) = data.as_chunks::<{ STATE + FORCE_FRAME + size_of::<[i16; 3]>() }>();
    for bytes in samples {
        let (state, rest) = bytes.split_first_chunk().expect("long enough");
        let (force, rest) = rest.split_first_chunk().expect("long enough");
        let state = State::parse(state);
        let rate = spi::vector(rest.as_array().expect("the rest"));
        let Some(force) = frame::acceleration(force) else { continue };
        let sample =
            frame::sample(Micros(0), force, rate, state.temperature).expect("any reading is in range");
        assert!(sample.angular_rate.iter().all(|rate| rate.rad_per_sec().abs() < 4.4));
        assert!(sample.specific_force.iter().all(|force| force.metre_per_sec2().abs() < 118.0));
        assert!(sample.temperature.is_none_or(|code| (-10_500..=15_100).contains(&code.0)));
        assert!(state.bytes < 1 << 14 && state.time < 1 << 24);
    }
}

/// Passes bytes as words of the FIFO: all readings are in range, and a damaged tag is refused.
pub fn asm330lhh(data: &[u8]) {
    let mut outputs = Outputs::default();
    let (words, _) = data.as_chunks::<WORD>();
    for bytes in words {
        let Some(word) = Word::parse(bytes) else { continue };
        for bit in 0..8 {
            let mut damaged = *bytes;
            damaged[0] ^= 1 << bit;
            assert_eq!(Word::parse(&damaged), None);
        }
        let Ok(Some(readings)) = outputs.add(word) else { continue };
        let sample = readings.sample(Micros(0)).expect("any reading is in range");
        assert!(sample.angular_rate.iter().all(|rate| rate.rad_per_sec().abs() < 5.01));
        assert!(sample.specific_force.iter().all(|force| force.metre_per_sec2().abs() < 157.0));
        assert!(sample.temperature.is_none_or(|code| (-10_300..=15_300).contains(&code.0)));
    }
}

pub fn icm42688(data: &[u8]) {
    let (packets, _) = data.as_chunks::<PACKET>();
    for packet in packets.iter().filter_map(|bytes| Packet::parse(bytes).ok()) {
        assert_eq!(Packet::parse(&packet.emit()), Ok(packet));
    }
}
