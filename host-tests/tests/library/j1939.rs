//! J1939 VDC2: published vectors, identifiers, exact integral.

use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::j1939::{VDC2_PGN, VDC2_PRIORITY, Validity, Vdc2, Vdc2Encoder, Vdc2Length, broadcast_id};
use gyronet::units::{AngularRate, SpecificForce};
use proptest::prelude::*;

const AT_REST: [SpecificForce; 3] = [SpecificForce(0); 3];

fn rate(deg_per_sec: f64) -> AngularRate {
    AngularRate::from_rad_per_sec(deg_per_sec.to_radians() as f32).expect("in range")
}

fn encode(rate: AngularRate) -> Vdc2 {
    Vdc2Encoder::default().encode(rate, Validity::Valid, &AT_REST)
}

#[test]
fn frames_equal_published_vectors() {
    assert_eq!(encode(rate(10.0)).emit()[3..5], [0x06, 0x83]);
    assert_eq!(encode(rate(0.0)).emit()[3..5], [0x71, 0x7D]);
    assert_eq!(broadcast_id(VDC2_PGN, VDC2_PRIORITY, 0x80).map(|id| id.as_raw()), Some(0x18F0_0980));
    assert_eq!(broadcast_id(0xF02A, 3, 0x80).map(|id| id.as_raw()), Some(0x0CF0_2A80));
    assert_eq!(broadcast_id(VDC2_PGN, 8, 0), None);
    assert_eq!(broadcast_id(0x4_0000, 0, 0), None);
    let frame: DataFrame = encode(rate(0.0)).frame(0x80).expect("eight bytes");
    assert!(matches!(frame.id(), Id::Extended(id) if id.as_raw() == 0x18F0_0980));
    assert_eq!(frame.data()[..3], [0xFF; 3], "signals that we have not");
}

#[test]
fn accelerations_are_encoded_and_limited() {
    let force = |value: f32| SpecificForce::from_metre_per_sec2(value).expect("in range");
    let vdc2 = Vdc2Encoder::default().encode(
        AngularRate::ZERO,
        Validity::Valid,
        &[force(1.0), force(-2.0), force(9.8)],
    );
    assert!((f64::from(vdc2.lateral) / 2048.0 - 15.687 + 2.0).abs() <= 0.5 / 2048.0);
    assert_eq!(vdc2.longitudinal, 135);
    let beyond = Vdc2Encoder::default().encode(
        AngularRate::ZERO,
        Validity::Valid,
        &[force(13.0), force(16.0), force(0.0)],
    );
    assert_eq!((beyond.longitudinal, beyond.lateral), (0xFE, 0xFE00));
}

#[test]
fn what_is_not_valid_is_not_a_value() {
    let mut encoder = Vdc2Encoder::default();
    for (rate, validity, code) in [
        (rate(1.0), Validity::NotAvailable, 0xFFFF),
        (rate(1.0), Validity::Error, 0xFE00),
        (rate(230.0), Validity::Valid, 0xFE00),
        (AngularRate(i32::MIN), Validity::Valid, 0xFE00),
        (AngularRate(i32::MAX), Validity::Valid, 0xFE00),
    ] {
        let vdc2 = encoder.encode(rate, validity, &AT_REST);
        assert_eq!(vdc2.yaw_rate, code);
        assert_eq!(vdc2.yaw_rate_rad_per_sec(), None);
    }
    assert_eq!(encoder.encode(rate(0.0), Validity::Valid, &AT_REST).yaw_rate, 32_113, "nothing is pending");
}

#[test]
fn each_signal_can_say_error() {
    let good = encode(rate(1.0));
    assert!(!good.has_error());
    assert!(Vdc2 { yaw_rate: 0xFE00, ..good }.has_error());
    assert!(Vdc2 { lateral: 0xFE00, ..good }.has_error());
    assert!(Vdc2 { longitudinal: 0xFE, ..good }.has_error());
}

#[test]
fn the_largest_value_is_one_and_leaves_its_remainder() {
    let mut encoder = Vdc2Encoder::default();
    // Three tenths of a code below it: the second must be a code less.
    let rate = AngularRate::from_rad_per_sec((64_254.7 / 8192.0 - 3.92) as f32).expect("in range");
    let codes = [0, 1].map(|_| encoder.encode(rate, Validity::Valid, &AT_REST).yaw_rate);
    assert_eq!(codes, [64_255, 64_254]);
}

#[test]
fn integral_is_exact_although_zero_is_no_code() {
    for parked in [0.0, 0.001, -0.004] {
        let mut encoder = Vdc2Encoder::default();
        let mut sum = 0.0;
        for k in 1..=60_000 {
            let vdc2 = encoder.encode(rate(parked), Validity::Valid, &AT_REST);
            sum += vdc2.yaw_rate_rad_per_sec().expect("valid");
            let due = rate(parked).rad_per_sec() * f64::from(k);
            assert!((sum - due).abs() <= 0.5 / 8192.0 + 1e-8, "{sum} {due}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn values_survive_the_bus(bytes in proptest::collection::vec(any::<u8>(), 0..10)) {
        match Vdc2::parse(&bytes) {
            Ok(vdc2) => prop_assert_eq!(&vdc2.emit()[3..], &bytes[3..]),
            Err(error) => prop_assert_eq!(error, Vdc2Length(bytes.len())),
        }
    }
}
