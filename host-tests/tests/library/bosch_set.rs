//! The Bosch MM5.10 set: published vectors, one table for three messages, exact integrals.

use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::bosch::{LAYOUTS, Message, Motion, SetEncoder, SignalStatus, Tx1, Tx1Error};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};
use proptest::prelude::*;

const STANDARD_GRAVITY: f32 = 9.806_65;

fn rate(deg_per_sec: f64) -> AngularRate {
    AngularRate::from_rad_per_sec(deg_per_sec.to_radians() as f32).expect("in range")
}

fn force(g: f32) -> SpecificForce {
    SpecificForce::from_metre_per_sec2(g * STANDARD_GRAVITY).expect("in range")
}

fn motion(yaw: f64, lateral: f32, counter: u8) -> Motion {
    Motion {
        angular_rate: [AngularRate::ZERO, AngularRate::ZERO, rate(yaw)],
        specific_force: [SpecificForce(0), force(lateral), force(1.0)],
        temperature: Some(CentiCelsius(2500)),
        rate_status: SignalStatus::OK,
        force_status: SignalStatus::OK,
        counter,
    }
}

#[test]
fn frames_equal_published_vectors() {
    let vectors = [
        (motion(0.0, 0.0, 0), [0x00, 0x80, 0x00, 0x4B, 0x00, 0x80, 0x00, 0xD1]),
        (motion(10.0, 0.1, 1), [0xD0, 0x87, 0x00, 0x4B, 0x11, 0x83, 0x01, 0x86]),
        (motion(-12.345, -0.5, 15), [0x5B, 0x76, 0x00, 0x4B, 0xAD, 0x70, 0x0F, 0xEA]),
        (motion(163.835, 4.0, 7), [0xFF, 0xFF, 0x00, 0x4B, 0x95, 0xFA, 0x07, 0x66]),
    ];
    for (motion, bytes) in vectors {
        let [tx1, ..] = SetEncoder::default().encode(&motion);
        assert_eq!(tx1.emit(), bytes);
        assert_eq!(Message::parse(&bytes), Ok(tx1));
        // The message that the pipeline emits by itself is the same one.
        assert_eq!(Message::from(Tx1::parse(&bytes).expect("checksum")), tx1);
    }
}

#[test]
fn a_sample_makes_three_messages() {
    let motion = Motion {
        angular_rate: [rate(3.0), rate(-2.0), rate(10.0)],
        specific_force: [force(0.2), force(0.1), force(1.0)],
        counter: 0x2B,
        ..motion(0.0, 0.0, 0)
    };
    let messages = SetEncoder::default().encode(&motion);
    let code = |deg_per_sec: f64| (deg_per_sec / 0.005) as i32 + 0x8000;
    // Roll goes out against the right-hand rule, as the part sends it.
    assert_eq!(messages.map(|m| i32::from(m.rate)), [code(10.0), code(-3.0), code(-2.0)]);
    let acceleration = |g: f64| (g / 0.000_127_465).round() as i32 + 0x8000;
    assert_eq!(
        messages.map(|m| i32::from(m.acceleration)),
        [acceleration(0.1), acceleration(0.2), acceleration(1.0)]
    );
    let read = messages.map(|m| [m.rate_deg_per_sec(), m.acceleration_g()]);
    for ([rate, force], due) in read.iter().zip([[10.0, 0.1], [-3.0, 0.2], [-2.0, 1.0]]) {
        assert!((rate - due[0]).abs() < 0.005 && (force - due[1]).abs() < 0.000_13, "{rate} {force}");
    }
    assert!(messages.iter().all(|m| m.counter == 0xB), "one sample, one counter");
    assert_eq!(messages.map(|m| m.temperature), [75, 0, 0]);
    let frames: Vec<DataFrame> =
        messages.iter().zip(&LAYOUTS).filter_map(|(message, layout)| message.frame(layout)).collect();
    let ids: Vec<u16> = frames
        .iter()
        .map(|frame| match frame.id() {
            Id::Standard(id) => id.as_raw(),
            Id::Extended(_) => 0,
        })
        .collect();
    assert_eq!(ids, [0x174, 0x178, 0x17C]);
}

#[test]
fn a_value_beyond_its_signal_is_marked() {
    let mut encoder = SetEncoder::default();
    let beyond = Motion { specific_force: [force(5.0), force(-5.0), force(1.0)], ..motion(170.0, 0.0, 0) };
    let [tx1, tx2, tx3] = encoder.encode(&beyond);
    assert_eq!((tx1.rate, tx1.rate_status), (u16::MAX, SignalStatus::FAILURE));
    assert_eq!((tx1.acceleration, tx1.acceleration_status), (0, SignalStatus::FAILURE));
    assert_eq!((tx2.acceleration, tx2.acceleration_status), (u16::MAX, SignalStatus::FAILURE));
    assert_eq!((tx2.rate_status, tx3.acceleration_status), (SignalStatus::OK, SignalStatus::OK));
    let extreme = Motion { angular_rate: [AngularRate(i32::MIN); 3], ..beyond };
    let [_, tx2, _] = encoder.encode(&extreme);
    assert_eq!((tx2.rate, tx2.rate_status), (u16::MAX, SignalStatus::FAILURE));
}

/// Ten minutes of a parked car whose rate is 0.001 deg/s: plain rounding would send nothing.
#[test]
fn integral_is_exact_on_all_three_axes() {
    let mut encoder = SetEncoder::default();
    let slow = [rate(0.001), rate(-0.001), rate(0.0007)];
    let parked = Motion { angular_rate: slow, ..motion(0.0, 0.0, 0) };
    let mut sums = [0i64; 3];
    for k in 1..=60_000 {
        for (sum, message) in sums.iter_mut().zip(encoder.encode(&parked)) {
            *sum += i64::from(message.rate) - 0x8000;
        }
        let [yaw, roll, pitch] = sums.map(|sum| sum as f64 * 0.005);
        let due = slow.map(|rate| rate.rad_per_sec().to_degrees() * f64::from(k));
        for error in [yaw - due[2], roll + due[0], pitch - due[1]] {
            // Half an LSB, and 1e-9 deg/s a frame from the arithmetic.
            assert!(error.abs() <= 0.0025 + 1e-9 * f64::from(k), "{error} deg/s x frames after {k}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn messages_survive_the_bus(bytes in any::<[u8; 7]>()) {
        let mut frame = [0; 8];
        frame[..7].copy_from_slice(&bytes);
        frame[7] = gyronet::can::bosch::CRC.checksum(&bytes);
        let message = Message::parse(&frame).expect("checksum");
        prop_assert_eq!(message.emit(), frame);
        frame[7] ^= 1;
        prop_assert!(
            matches!(Message::parse(&frame), Err(Tx1Error::Crc { .. })),
            "a wrong checksum is refused"
        );
        prop_assert_eq!(Message::parse(&bytes), Err(Tx1Error::Length(7)));
    }
}
