//! The four precisions of MTData2.

use gyronet::sensor::framer::Protocol;
use gyronet::sensor::xsens::Precision;
use gyronet::sensor::xsens::{MtData2, Mti, Xbus, XsensError};
use proptest::prelude::*;

const ALL: [Precision; 4] =
    [Precision::Single, Precision::Fixed1220, Precision::Fixed1632, Precision::Double];

#[test]
fn numbers_equal_published_ones() {
    for (precision, bytes, value, tolerance) in [
        (Precision::Fixed1220, &[0x03, 0x9a, 0xdf, 0x03][..], 57.679_446_22, 5e-9),
        (Precision::Fixed1220, &[0x00, 0xbe, 0x1f, 0x81], 11.882_691_38, 5e-9),
        (Precision::Fixed1632, &[0xad, 0xf0, 0x52, 0x98, 0x00, 0x39], 57.679_448_282_346_13, 0.0),
        (Precision::Fixed1632, &[0xf6, 0x3f, 0xca, 0xf0, 0xff, 0xff], -0.038_089_100_271_463_394, 0.0),
    ] {
        let read = precision.parse(bytes).expect("as long as it must be");
        assert!((read - value).abs() <= tolerance, "{read} instead of {value}");
        assert_eq!(precision.emit(value)[..], *bytes);
    }
    assert_eq!(Precision::Fixed1220.emit(1e9)[..], i32::MAX.to_be_bytes());
    assert_eq!(Precision::Fixed1632.emit(-1e9)[..], [0, 0, 0, 0, 0x80, 0]);
}

#[test]
fn one_message_is_the_same_in_each_precision() {
    // Numbers that each form holds exactly.
    let message = MtData2 {
        packet_counter: Some(7),
        sample_time_fine: Some(100),
        acceleration: Some([0.5, -0.25, 9.8125]),
        rate_of_turn: Some([-0.125, 0.0, 0.75]),
        temperature: Some(25.5),
        status: Some(3),
    };
    assert_eq!(message.emit_as(Precision::Single)[..], message.emit()[..]);
    let samples = ALL.map(|precision| {
        let frame = message.emit_as(precision);
        let (_, data) = Xbus::parse(&frame).expect("intact");
        assert_eq!(MtData2::parse(data), Ok(message), "{precision:?}");
        let mut mti = Mti::new();
        frame.iter().for_each(|byte| mti.receive(*byte));
        mti.next_sample().expect("a frame").expect("a sample")
    });
    assert!(samples.iter().all(|sample| *sample == samples[0]));
}

#[test]
fn a_length_of_another_precision_is_refused() {
    for id in [0x0810u16, 0x4020, 0x8020] {
        for (low, precision) in (0u16..).zip(ALL) {
            for system in [0, 4, 8] {
                let id = id | low | system;
                let numbers = if id & 0xFFF0 == 0x0810 { 1 } else { 3 };
                for len in 0..30 {
                    let data = [&id.to_be_bytes()[..], &[len as u8], &vec![0; len]].concat();
                    let result = MtData2::parse(&data);
                    if len == numbers * precision.bytes() {
                        assert!(result.is_ok(), "{id:04x}: {len} bytes");
                    } else {
                        assert_eq!(result, Err(XsensError::Format { id }), "{len} bytes");
                    }
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trips(code in any::<i64>(), double in any::<f64>()) {
        let fixed = f64::from(code as i32) / f64::from(1 << 20);
        prop_assert_eq!(Precision::Fixed1220.parse(&Precision::Fixed1220.emit(fixed)), Some(fixed));
        let fixed = (code >> 16) as f64 / (1u64 << 32) as f64;
        prop_assert_eq!(Precision::Fixed1632.parse(&Precision::Fixed1632.emit(fixed)), Some(fixed));
        prop_assert_eq!(Precision::Double.parse(&Precision::Double.emit(double)), Some(double));
        let single = f64::from(double as f32);
        prop_assert_eq!(Precision::Single.parse(&Precision::Single.emit(single)), Some(single));
    }

    /// The board reads the exact number without f64 and rounds it once. All NaN count as one.
    #[test]
    fn f32_is_rounded_once(code in any::<i64>()) {
        let bytes = code.to_be_bytes();
        let bits = |value: f32| if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() };
        for precision in ALL {
            let bytes = &bytes[..precision.bytes()];
            let exact = precision.parse(bytes).map(|value| bits(value as f32));
            prop_assert_eq!(precision.parse_f32(bytes).map(bits), exact, "{:?}", precision);
        }
    }

    /// The sum finds every single flipped bit.
    #[test]
    fn damage_is_refused(
        counter in any::<Option<u16>>(),
        time in any::<Option<u32>>(),
        rate in any::<Option<[f32; 3]>>(),
        temperature in any::<Option<f32>>(),
        precision in 0..4usize,
    ) {
        let message = MtData2 {
            packet_counter: counter,
            sample_time_fine: time,
            acceleration: rate,
            rate_of_turn: rate,
            temperature,
            status: counter.map(u32::from),
        };
        let frame = message.emit_as(ALL[precision]);
        prop_assert!(Xbus::check(&frame));
        for length in 0..frame.len() {
            prop_assert_eq!(Xbus::parse(&frame[..length]), None);
        }
        for bit in 0..frame.len() * 8 {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            prop_assert_eq!(Xbus::parse(&damaged), None, "bit {}", bit);
        }
    }
}
