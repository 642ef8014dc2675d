//! Passes bytes to the parsers of the sensors.

use super::Seed;
use crate::gnss::{Pvt, sentence};
use crate::wire::{bytes, feed, message, synthetic_frame};
use gyronet::heading::{GnssLine, GnssProtocol};
use gyronet::sensor::bmi088::frame::{self, FORCE_FRAME, RATE_FRAME, STATE, State};
use gyronet::sensor::crc::CRC_32_MPEG_2;
use gyronet::sensor::dsp1760::Dsp1760;
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::icm42688::packet::{PACKET, Packet};
use gyronet::sensor::xsens::{MtData2, Mti, Xbus};
use gyronet::units::Micros;

/// Passes bytes as a stream to the MTi's parser, and as the data of a message.
pub fn xsens(data: &[u8]) {
    let samples = feed(&mut Mti::new(), data);
    // Received several at a time, the same bytes give the same samples.
    let (mut rest, mut mti, mut again) = (data, Mti::new(), Vec::new());
    while !rest.is_empty() {
        rest = &rest[mti.receive_some(rest)..];
        again.extend(core::iter::from_fn(|| mti.next_sample()));
    }
    assert_eq!(format!("{again:?}"), format!("{samples:?}"));
    if let Ok(message) = MtData2::parse(data) {
        // A parsed message must be parsed as the same again after it was emitted; bytes are compared, since NaN is
        // not equal to itself.
        let frame = message.emit();
        let (_, again) = Xbus::parse(&frame).expect("an emitted frame");
        let again = MtData2::parse(again).expect("an emitted message");
        assert_eq!(again.emit(), frame);
    }
}

pub fn xsens_seeds() -> Vec<Seed> {
    let frame = message(77).emit();
    let (_, data) = Xbus::parse(&frame).expect("an emitted frame");
    vec![("stream", [synthetic_frame(), message(200).emit().to_vec()].concat()), ("data", data.to_vec())]
}

/// Passes bytes as a stream to the parser, as a message, and as a message with a valid checksum.
pub fn dsp1760(data: &[u8]) {
    let samples = feed(&mut Dsp1760::new(), data);
    let (mut rest, mut part, mut again) = (data, Dsp1760::new(), Vec::new());
    while !rest.is_empty() {
        rest = &rest[part.receive_some(rest)..];
        again.extend(core::iter::from_fn(|| part.next_sample()));
    }
    assert_eq!(format!("{again:?}"), format!("{samples:?}"));
    let mut frame = data.to_vec();
    frame.extend(CRC_32_MPEG_2.checksum(data).to_be_bytes());
    for frame in [data, &frame] {
        if let Ok(message) = Message::parse(frame) {
            let again = Message::parse(&message.emit()).expect("an emitted message");
            // They are compared by their bytes, because NaN is not equal to itself.
            assert_eq!(again.emit(), message.emit());
        }
    }
}

pub fn dsp1760_seeds() -> Vec<Seed> {
    let message = |sequence, extra| {
        let (rotation, acceleration) = ([0.0, 0.0, 1.75e-5], [0.0, 0.0, 1.0]);
        Message { rotation, acceleration, extra, validity: Validity::GYRO, sequence }.emit().to_vec()
    };
    let [extras @ .., self_test] = [
        message(1, Extra::Temperature(25)),
        message(2, Extra::Timed { time: 123_456_789, temperature: 25 }),
        [bytes("fe 81 00 aa 7f 7f 7f 7f 7f 7f 55"), message(4, Extra::Temperature(25))].concat(),
    ];
    vec![("stream", extras.concat()), ("self_test", self_test)]
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

pub fn gnss_seeds() -> Vec<Seed> {
    let rmc = sentence("GNRMC,092633.00,A,4722.61400,N,00832.50200,E,19.438,210.00,170524,,,A,V");
    let vtg = sentence("GPVTG,210.00,T,,M,19.438,N,36.000,K,D");
    vec![("nmea", [rmc, vtg].concat()), ("ubx", Pvt::GOOD.bytes())]
}

/// Passes bytes as the state of the accelerometer, a frame of its FIFO and a frame of the gyro's: all readings are in range.
pub fn bmi088(data: &[u8]) {
    let (samples, _) = data.as_chunks::<{ STATE + FORCE_FRAME + RATE_FRAME }>();
    for bytes in samples {
        let (state, rest) = bytes.split_first_chunk().expect("long enough");
        let (force, rest) = rest.split_first_chunk().expect("long enough");
        let state = State::parse(state);
        let rate = frame::vector(rest.as_array().expect("the rest"));
        let Some(force) = frame::acceleration(force) else { continue };
        let sample =
            frame::sample(Micros(0), force, rate, state.temperature).expect("any reading is in range");
        assert!(sample.angular_rate.iter().all(|rate| rate.rad_per_sec().abs() < 4.4));
        assert!(sample.specific_force.iter().all(|force| force.metre_per_sec2().abs() < 118.0));
        assert!(sample.temperature.is_none_or(|code| (-10_500..=15_100).contains(&code.0)));
        assert!(state.bytes < 1 << 14 && state.time < 1 << 24);
    }
}

pub fn bmi088_seeds() -> Vec<Seed> {
    let state = bytes("01 02 03 00 00 00 00 00 00 00 00 60 07 00");
    vec![("sample", [state, bytes("84 00 00 fc ff ab 0a"), bytes("00 00 fe ff 1f 05")].concat())]
}

pub fn icm42688(data: &[u8]) {
    let (packets, _) = data.as_chunks::<PACKET>();
    for packet in packets.iter().filter_map(|bytes| Packet::parse(bytes).ok()) {
        assert_eq!(Packet::parse(&packet.emit()), Ok(packet));
    }
}

pub fn icm42688_seeds() -> Vec<Seed> {
    let (acceleration, rate) = ([Some(0), Some(-1), Some(2048)], [Some(5), None, Some(-164)]);
    let packet = Packet { acceleration, rate, temperature: Some(3), time: 1_000 };
    vec![("packet_4", packet.emit().to_vec())]
}
