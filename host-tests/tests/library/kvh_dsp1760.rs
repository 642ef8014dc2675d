//! KVH DSP-1760: recorded and constructed frames, damage, lost messages, commands.

use gyronet::sample::FogSample;
use gyronet::sensor::dsp1760::message::{Extra, Message, MessageError, Validity};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Error};
use gyronet::sensor::{ByteSource, Source};
use gyronet::units::{Angle, CentiCelsius, Micros};
use gyronet_host_tests::wire::{bytes, feed};

/// The bytes of a message that a real part has sent.
const RECORDED: &str = "FE81FF55 BC646C1E 3C3FF981 3B3C1E78 BC065FB7 BB2FBD79 3F7E9800 77470014 168D8B1D";
const PLUS_10_DPS: &str = "fe81ff55 0000000000000000 393702d3 000000000000000000000000 07000019 ce6fb608";
const MINUS_10_DPS: &str = "fe81ff55 0000000000000000 b93702d3 000000000000000000000000 037ffffb 09a87f88";
const HUNDREDTHS: &str = "fe81ff55 0000000000000000 3727c5ac 000000000000000000000000 070509e6 e161f0f6";
const HUNDREDTHS_Z_BAD: &str =
    "fe81ff55 0000000000000000 3727c5ac 000000000000000000000000 030509e6 9d94bcf3";
const TIMED: &str = "fe81ff56 0000000000000000 379268A8 0000000000000000 3f800000 075bcd15 77010019 5d9c71b2";

fn feed_new(bytes: &[u8]) -> Vec<Result<FogSample, Dsp1760Error>> {
    feed(&mut Dsp1760::new(), bytes)
}

fn message(sequence: u8, z: f32) -> Message {
    Message {
        rotation: [0.0, 0.0, z],
        acceleration: [0.0; 3],
        extra: Extra::Temperature(25),
        validity: Validity::GYRO,
        sequence,
    }
}

#[test]
fn a_recorded_frame_is_read() {
    let raw = bytes(RECORDED);
    let message = Message::parse(&raw).expect("it is intact");
    assert_eq!(message.rotation, [-0.013_941_793, 0.011_717_201, 0.002_870_468_4]);
    assert_eq!(message.acceleration, [-0.008_201_531, -0.002_681_581_5, 0.994_506_84]);
    assert_eq!(message.validity, Validity::ALL);
    assert_eq!((message.sequence, message.extra), (71, Extra::Temperature(20)));
    assert_eq!(message.emit()[..], raw[..]);
}

#[test]
fn constructed_frames_are_read() {
    let ten = f32::from_bits(0x3937_02d3);
    let slow = Message { extra: Extra::Temperature(2534), ..message(5, f32::from_bits(0x3727_c5ac)) };
    let cold = Message { extra: Extra::Temperature(-5), validity: Validity(3), ..message(127, -ten) };
    let timed = Message {
        acceleration: [0.0, 0.0, 1.0],
        extra: Extra::Timed { time: 123_456_789, temperature: 25 },
        validity: Validity::ALL,
        ..message(1, f32::from_bits(0x3792_68A8))
    };
    let made = [
        (PLUS_10_DPS, message(0, ten)),
        (MINUS_10_DPS, cold),
        (HUNDREDTHS, slow),
        (HUNDREDTHS_Z_BAD, Message { validity: Validity(3), ..slow }),
        (TIMED, timed),
    ];
    for (hex, message) in made {
        assert_eq!(Message::parse(&bytes(hex)), Ok(message), "{hex}");
        assert_eq!(message.emit()[..], bytes(hex), "{hex}");
    }
}

#[test]
fn samples_carry_angle_time_and_temperature() {
    let z = Angle::from_rad(f32::from_bits(0x3937_02d3)).expect("finite");
    // 10 deg/s for a millisecond, to a part in 2^24.
    assert!((z.rad() - 0.01f64.to_radians()).abs() < 1e-11);
    let first = FogSample {
        time: Micros(1_000),
        span: 1_000,
        lost: 0,
        increment: [Some(Angle(0)), Some(Angle(0)), Some(z)],
        temperature: Some(CentiCelsius(2_500)),
    };
    assert_eq!(feed_new(&bytes(PLUS_10_DPS)), [Ok(first)]);
    // The number before 0 is 127: two frames in that order are one step apart.
    let part = &mut Dsp1760::new();
    let samples = feed(part, [bytes(MINUS_10_DPS), bytes(PLUS_10_DPS)].concat());
    let invalid = samples[0].expect("a sample");
    assert_eq!((invalid.increment[2], invalid.temperature), (None, Some(CentiCelsius(-500))));
    assert_eq!(samples[1..], [Ok(FogSample { time: Micros(2_000), ..first })]);
    assert_eq!(part.bad_checksums(), 0);
    // Of a gyro that is set to hundredths.
    assert_eq!(feed_new(&bytes(HUNDREDTHS))[0].map(|sample| sample.temperature), Ok(None));
    assert_eq!(feed_new(&bytes(TIMED))[0].map(|sample| sample.time), Ok(Micros(123_456_789)));
}

#[test]
fn there_are_three_axes() {
    let good = |axis| (Validity(0xFF).gyro(axis), Validity(0xFF).accelerometer(axis));
    assert_eq!([0, 1, 2, 3].map(good), [(true, true), (true, true), (true, true), (false, false)]);
    let bad = |axis| (Validity(0).gyro(axis), Validity(0).accelerometer(axis));
    assert_eq!([0, 1, 2].map(bad), [(false, false); 3]);
}

#[test]
fn the_parser_resynchronises() {
    let (recorded, other) = (bytes(RECORDED), bytes(PLUS_10_DPS));
    let false_start = [0xFE, 0x81, 0xFE, 0x81, 0xFF];
    for before in [&false_start[..], &other[16..], &[&false_start, &other[16..]].concat()] {
        assert_eq!(feed_new(&[before, &recorded].concat()), feed_new(&recorded), "after {before:02x?}");
    }
    // A damaged frame is a candidate whose checksum does not fit.
    let mut damaged = other.clone();
    damaged[20] ^= 1;
    let part = &mut Dsp1760::new();
    assert_eq!(feed(part, [&damaged[..], &damaged, &recorded].concat()).len(), 1);
    assert_eq!((part.bad_checksums(), ByteSource::bad_checksums(part)), (2, 2));
    // A header inside the payload: an acceleration whose bits are FE 81 FF 55.
    let hidden = Message { acceleration: [f32::from_bits(0xFE81_FF55), 0.0, 0.0], ..message(3, 1e-5) }.emit();
    assert_eq!(feed_new(&[&hidden[10..], &hidden[..], &recorded[..]].concat()).len(), 2);
}

/// The longest ones fill the framer.
#[test]
fn a_frame_gives_way_to_the_next_whether_it_was_fetched_or_not() {
    let frames =
        [bytes(TIMED), Message { sequence: 2, ..Message::parse(&bytes(TIMED)).unwrap() }.emit().to_vec()];
    let both = feed_new(&frames.concat());
    assert!(both.len() == 2 && both.iter().all(Result::is_ok), "{both:?}");
    let part = &mut Dsp1760::new();
    frames.concat().iter().for_each(|byte| part.receive(*byte));
    assert_eq!(part.next_sample().into_iter().collect::<Vec<_>>(), feed_new(&frames[1]));
    assert_eq!(part.next_sample(), None);
}

#[test]
fn self_tests_are_passed_over() {
    let short = bytes("FE8100AA 7F7F7F7F7F7F 55");
    let long = bytes("FE8100AB 7F7F7F7F7F7F7F7F 55");
    let part = &mut Dsp1760::new();
    let stream = [&short[..], &bytes(RECORDED), &long, &bytes(PLUS_10_DPS), &short].concat();
    assert_eq!(feed(part, &stream).len(), 2);
    // One that is cut off must not take the frame behind it along.
    for cut in 1..short.len() {
        let stream = [&short[..cut], &bytes(RECORDED)].concat();
        assert_eq!(feed_new(&stream).len(), 1, "cut after {cut} bytes");
    }
}

#[test]
fn lost_and_repeated_messages_are_told() {
    let part = &mut Dsp1760::new();
    let mut take = |sequence| feed(part, message(sequence, 1e-6).emit())[0].map(|s| (s.time.0, s.lost));
    assert_eq!(take(126), Ok((1_000, 0)));
    assert_eq!(take(127), Ok((2_000, 0)));
    assert_eq!(take(2), Ok((5_000, 2)));
    assert_eq!(take(2), Err(Dsp1760Error::Repeated { sequence: 2 }));
    assert_eq!(take(3), Ok((6_000, 0)));
}

#[test]
fn a_number_that_is_none_is_not_valid() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let made = Message { rotation: [1e-6, bad, 1e-6], validity: Validity::ALL, ..message(0, 0.0) };
        assert_eq!(Message::parse(&made.emit()).expect("intact").validity, Validity(0x75));
        assert_eq!(feed_new(&made.emit())[0].expect("a sample").increment[1], None);
        let made = Message { acceleration: [0.0, 0.0, bad], validity: Validity::ALL, ..message(0, 0.0) };
        assert_eq!(Message::parse(&made.emit()).expect("intact").validity, Validity(0x37));
    }
    // Faster than anything turns: 1 rad in a millisecond.
    assert_eq!(feed_new(&message(0, 1.0).emit())[0].expect("a sample").increment[2], None);
}

/// A CRC of 32 bits finds every single flipped bit.
#[test]
fn damage_is_refused_and_errors_say_where() {
    let mut frame = bytes(RECORDED);
    assert_eq!(Message::parse(&frame[1..]), Err(MessageError::Header));
    assert_eq!(Message::parse(&frame[..35]), Err(MessageError::Length { got: 35, expected: 36 }));
    frame[29] = 128;
    assert_eq!(Message::parse(&frame), Err(MessageError::Sequence { got: 128 }));
    for frame in [bytes(RECORDED), bytes(TIMED)] {
        for length in 0..frame.len() {
            assert!(feed_new(&frame[..length]).is_empty());
        }
        for bit in 0..frame.len() * 8 {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(feed_new(&damaged).is_empty(), "bit {bit}");
        }
    }
}
