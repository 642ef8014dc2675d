//! MTData2 messages, alone and in a stream: recorded frames, bad readings and packets, damage, time that wraps, and
//! a port that fails.

use super::line::Line;
use embedded_io::ErrorKind;
use gyronet::sample::{ImuSample, Validity};
use gyronet::sensor::serial::{Serial, SerialError};
use gyronet::sensor::xsens::{MID_MT_DATA2, MtData2, Mti, XsensError};
use gyronet::sensor::{ByteSource, Source};
use gyronet::units::{AngularRate, CentiCelsius, Micros, RangeError, SpecificForce};
use gyronet_host_tests::wire::{feed, feed_new, message, real_frame, synthetic_frame};

fn framed(mid: u8, data: &[u8]) -> Vec<u8> {
    let frame = [&[0xFF, mid, data.len() as u8], data].concat();
    let sum = frame.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    [&[0xFA], &frame[..], &[sum.wrapping_neg()]].concat()
}

/// A packet of so many zeros.
fn packet(id: u16, len: usize) -> Vec<u8> {
    framed(MID_MT_DATA2, &[&id.to_be_bytes()[..], &[len as u8], &vec![0; len]].concat())
}

#[test]
fn a_real_frame_is_read() {
    let raw = real_frame();
    let message = MtData2::parse(&raw[4..raw.len() - 1]).expect("it is intact");
    assert_eq!(message.packet_counter, Some(43_398));
    assert_eq!(message.sample_time_fine, Some(0x0314_ED53));
    assert_eq!(message.status, Some(0x0180_0007));
    assert_eq!(message.temperature, None);
    for (values, printed) in [
        (message.acceleration, [-0.017_374_2, -7.255_744_9, -1.209_552_5]),
        (message.rate_of_turn, [-0.002_965_7, 0.002_203_5, 0.001_722_6]),
    ] {
        for (value, printed) in values.expect("it is there").iter().zip(printed) {
            // Seven decimals were printed.
            assert!((f64::from(*value) - printed).abs() <= 0.5e-7, "{value} is not {printed}");
        }
    }
    let samples = feed_new(raw);
    assert_eq!(samples.len(), 1);
    let sample = samples[0].expect("a sample");
    assert_eq!(sample.time, Micros(0x0314_ED53 * 100));
    assert_eq!(
        sample.specific_force[1],
        SpecificForce((f64::from(f32::from_bits(0xC0E8_2F10)) * 1_048_576.0).round() as i32)
    );
    assert_eq!(
        sample.angular_rate[2].0,
        (f64::from(f32::from_bits(0x3AE1_C7E5)) * 134_217_728.0).round() as i32
    );
    assert_eq!((sample.temperature, sample.validity), (None, Validity::Good));
}

#[test]
fn a_synthetic_frame_is_read() {
    let expected = ImuSample {
        time: Micros(10_000),
        specific_force: [SpecificForce(0), SpecificForce(0), SpecificForce(10_286_531)],
        angular_rate: [AngularRate(0), AngularRate(0), AngularRate(23_425_412)],
        temperature: None,
        validity: Validity::Good,
    };
    assert_eq!(feed_new(synthetic_frame()), [Ok(expected)]);
    let made = MtData2 {
        packet_counter: Some(1),
        sample_time_fine: Some(100),
        acceleration: Some([0.0, 0.0, 9.81]),
        rate_of_turn: Some([0.0, 0.0, 10f32.to_radians()]),
        temperature: None,
        status: Some(3),
    };
    assert_eq!(made.emit()[..], synthetic_frame());
    let warm = MtData2 { temperature: Some(25.0), ..MtData2::default() };
    assert_eq!(warm.emit()[4..11], [0x08, 0x10, 4, 0x41, 0xC8, 0, 0]);
}

#[test]
fn readings_that_cannot_be_are_refused() {
    use RangeError::{NotFinite, OutOfRange};
    for (value, error) in
        [(f32::NAN, NotFinite), (f32::INFINITY, NotFinite), (f32::NEG_INFINITY, NotFinite), (1e9, OutOfRange)]
    {
        for axis in 0..3 {
            let mut vector = [0.0; 3];
            vector[axis] = value;
            let bad = MtData2 { acceleration: Some(vector), ..message(1) };
            assert_eq!(feed_new(bad.emit()), [Err(XsensError::Reading { id: 0x4020, error })]);
            let bad = MtData2 { rate_of_turn: Some(vector), ..message(1) };
            assert_eq!(feed_new(bad.emit()), [Err(XsensError::Reading { id: 0x8020, error })]);
        }
    }
    let edge = |rate| feed_new(MtData2 { rate_of_turn: Some([0.0, 0.0, rate]), ..message(1) }.emit())[0];
    assert_eq!(edge(16.0), Err(XsensError::Reading { id: 0x8020, error: OutOfRange }));
    assert_eq!(edge(-16.0).unwrap().angular_rate[2], AngularRate(i32::MIN));
}

#[test]
fn missing_packets_are_named() {
    let whole = message(1);
    for (id, message) in
        [(0x4020, MtData2 { acceleration: None, ..whole }), (0x8020, MtData2 { rate_of_turn: None, ..whole })]
    {
        assert_eq!(feed_new(message.emit()), [Err(XsensError::Missing { id })]);
    }
    let unstamped = feed_new(MtData2 { sample_time_fine: None, ..whole }.emit())[0];
    assert_eq!(unstamped.map(|sample| sample.time), Ok(gyronet::sample::NO_STAMP));
    let spare = MtData2 { packet_counter: None, temperature: None, status: None, ..whole };
    assert!(feed_new(spare.emit())[0].is_ok());
}

#[test]
fn packets_of_a_wrong_length_are_refused() {
    for id in [0x1020u16, 0x1060, 0x0810, 0x4020, 0x8020, 0xE020] {
        for len in [0, 1, 3, 5, 11, 13] {
            assert_eq!(feed_new(packet(id, len)), [Err(XsensError::Format { id })], "{len}");
        }
    }
    // FP12.20, FP16.32 and double.
    for (id, len) in [(0x4021, 12), (0x4022, 18), (0x8023, 24), (0x0811, 4)] {
        assert_eq!(feed_new(packet(id, len)), [Err(XsensError::Format { id })]);
    }
    assert_eq!(MtData2::parse(&[0x40, 0x20, 12, 0]), Err(XsensError::Truncated { id: 0x4020 }));
    assert_eq!(MtData2::parse(&[0x40]), Err(XsensError::Truncated { id: 0 }));
    assert_eq!(MtData2::parse(&[]), Ok(MtData2::default()));
}

/// The old protocol's data, an error message, and a message of extended length between two good ones.
#[test]
fn other_messages_are_named() {
    let extended = [&[0xFA, 0xFF, 0x36, 0xFF, 0x01, 0x2C][..], &[0x55; 301]].concat();
    let good = || message(1).emit().to_vec();
    let bytes = [good(), framed(0x32, &[0; 38]), framed(0x42, &[3]), extended, good()].concat();
    let seen: Vec<_> = feed_new(bytes).into_iter().map(|result| result.err()).collect();
    let foreign = |mid| Some(XsensError::Foreign { mid });
    assert_eq!(seen, [None, foreign(0x32), foreign(0x42), foreign(0x36), None]);
}

#[test]
fn status_and_temperature_are_read() {
    for bit in 0..32 {
        let made = MtData2 { status: Some(1 | 1 << bit), ..message(1) };
        let saturated = feed_new(made.emit())[0].unwrap().validity == Validity::Saturated;
        assert_eq!(saturated, (8..14).contains(&bit), "bit {bit}");
    }
    let failed = MtData2 { status: Some(0x0180_0006), ..message(1) };
    assert_eq!(feed_new(failed.emit()), [Err(XsensError::SelfTest)]);
    for (degrees, code) in [
        (25.344, Some(CentiCelsius(2_534))),
        (-40.0, Some(CentiCelsius(-4_000))),
        (f32::NAN, None),
        (400.0, None),
        (f32::INFINITY, None),
    ] {
        let made = MtData2 { temperature: Some(degrees), ..message(1) };
        assert_eq!(feed_new(made.emit())[0].unwrap().temperature, code, "{degrees}");
    }
}

#[test]
fn a_message_is_read_as_it_was_sent_or_not_at_all() {
    let heard = MtData2 { temperature: Some(25.5), ..message(100) };
    for made in [heard, MtData2 { status: None, ..heard }, MtData2::default()] {
        let frame = made.emit();
        assert_eq!(frame[1..].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)), 0);
        assert_eq!(MtData2::parse(&frame[4..frame.len() - 1]), Ok(made));
        // No truncated frame and no flipped bit is believed.
        assert!((0..frame.len()).all(|length| feed_new(frame.iter().take(length).copied()).is_empty()));
        for bit in 0..frame.len() * 8 {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(feed_new(damaged).is_empty(), "bit {bit}");
        }
    }
}

#[test]
fn time_wraps_and_steps_back() {
    let mut mti = Mti::new();
    let ticks = [u32::MAX - 149, u32::MAX - 49, 50, 150, 100, 250];
    let samples = feed(&mut mti, ticks.iter().flat_map(|ticks| message(*ticks).emit()));
    let first = u64::from(u32::MAX - 149) * 100;
    let times: Vec<u64> = samples.iter().map(|sample| sample.unwrap().time.0 - first).collect();
    assert_eq!(times, [0, 10_000, 20_000, 30_000, 25_000, 40_000]);
}

#[test]
fn an_mti_measures_over_a_port_that_loses_a_byte() {
    // Two frames, a lost byte, a damaged frame, a frame.
    let mut port = Line::default();
    let bytes = [&real_frame()[..], &message(200).emit()].concat();
    port.receive(&bytes);
    port.lose();
    let without = MtData2 { acceleration: None, ..message(1) };
    port.receive(&[&message(300).emit()[5..], &message(400).emit(), &without.emit()].concat());
    let mut line = Serial::new(port, Mti::new());
    let expected: Vec<_> =
        feed_new(bytes).into_iter().map(|sample| Some(Ok(sample.expect("intact")))).collect();
    assert_eq!([line.next_sample(), line.next_sample()], expected[..]);
    assert_eq!(line.next_sample(), Some(Err(SerialError::Port(ErrorKind::Other))));
    assert_eq!(line.next_sample().map(|sample| sample.expect("intact").time.0), Some(40_000));
    let missing = XsensError::Missing { id: 0x4020 };
    assert_eq!(line.next_sample(), Some(Err(SerialError::Part(missing))), "a bad message is not a bad port");
    assert_eq!(line.next_sample(), None);
    assert_eq!(line.part().bad_checksums(), 0);
    let (port, _) = line.destroy();
    assert!(port.is_read());
}
