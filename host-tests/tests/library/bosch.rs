//! The Bosch MM5.10 set: published vectors, limits, and a receiver that never loses an angle.

use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::bosch::{
    LAYOUTS, Message, MessageError, Motion, SetEncoder, SignalStatus, encode_temperature,
};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::deg_rate;

const STANDARD_GRAVITY: f32 = 9.806_65;

fn force(g: f32) -> SpecificForce {
    SpecificForce::from_metre_per_sec2(g * STANDARD_GRAVITY).expect("in range")
}

fn motion(yaw: f64, lateral: f32, counter: u8) -> Motion {
    Motion {
        angular_rate: [AngularRate::ZERO, AngularRate::ZERO, deg_rate(yaw)],
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
        assert_eq!(Message::parse(&bytes[..7]), Err(MessageError::Length(7)));
        for bit in 0..64 {
            let damaged = (u64::from_le_bytes(bytes) ^ 1 << bit).to_le_bytes();
            assert!(matches!(Message::parse(&damaged), Err(MessageError::Crc { .. })), "bit {bit}");
        }
    }
}

#[test]
fn a_sample_makes_three_messages() {
    let motion = Motion {
        angular_rate: [3.0, -2.0, 10.0].map(deg_rate),
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
    for (rate, due) in messages.map(|m| m.rate_deg_per_sec()).into_iter().zip([10.0, -3.0, -2.0]) {
        assert!((rate - due).abs() < 0.005, "{rate}");
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
    encoder.encode(&motion(0.0049, 0.0, 0));
    let beyond = Motion { specific_force: [force(5.0), force(-5.0), force(1.0)], ..motion(170.0, 0.0, 0) };
    let [tx1, tx2, tx3] = encoder.encode(&beyond);
    assert_eq!((tx1.rate, tx1.rate_status), (u16::MAX, SignalStatus::FAILURE));
    assert_eq!((tx1.acceleration, tx1.acceleration_status), (0, SignalStatus::FAILURE));
    assert_eq!((tx2.acceleration, tx2.acceleration_status), (u16::MAX, SignalStatus::FAILURE));
    assert_eq!((tx2.rate_status, tx3.acceleration_status), (SignalStatus::OK, SignalStatus::OK));
    assert_eq!(
        encoder.encode(&motion(0.0, 0.0, 0))[0].rate,
        0x8000,
        "the residual of a bad frame is dropped"
    );
    let specific_force = [SpecificForce(i32::MIN), SpecificForce(i32::MAX), force(1.0)];
    let extreme = Motion { angular_rate: [AngularRate(i32::MIN); 3], specific_force, ..beyond };
    let [tx1, tx2, _] = encoder.encode(&extreme);
    assert_eq!((tx1.rate, tx1.rate_status), (0, SignalStatus::FAILURE));
    assert_eq!((tx2.rate, tx2.rate_status), (u16::MAX, SignalStatus::FAILURE));
    assert_eq!([tx1, tx2].map(|sent| sent.acceleration), [u16::MAX, 0]);
    assert!([tx1, tx2].iter().all(|sent| sent.acceleration_status == SignalStatus::FAILURE));
}

/// A receiver's integral is never off by more than half a step of 0.005 deg/s for a period: in ten minutes at random rates,
/// and parked at 0.001 deg/s, where plain rounding would send nothing.
#[test]
fn integral_is_exact_on_all_three_axes() {
    let (mut encoder, mut noise) = (SetEncoder::default(), Noise::new(1));
    let (mut received, mut turned) = ([0i64; 3], [0i64; 3]);
    for k in 0..120_000 {
        let any = |_| AngularRate(noise.int(-380_000_000, 380_000_000) as i32);
        let rates = if k < 60_000 { [0, 1, 2].map(any) } else { [0.001, -0.001, 0.0007].map(deg_rate) };
        let messages = encoder.encode(&Motion { angular_rate: rates, ..motion(0.0, 0.0, 0) });
        // Yaw, roll against the right-hand rule, pitch.
        for (axis, (message, sign)) in [2, 0, 1].into_iter().zip(messages.iter().zip([1, -1, 1])) {
            received[axis] += sign * (i64::from(message.rate) - 0x8000);
            turned[axis] += i64::from(rates[axis].0);
            let due = turned[axis] as f64 / f64::from(AngularRate::PER_RAD_PER_SEC);
            // The scale's own rounding, 0.45 in 447,623,277, and this test's arithmetic.
            let off =
                (received[axis] as f64 * 0.005 - due.to_degrees()).abs() - 1e-9 * due.abs().to_degrees();
            assert!(off <= 0.0025 * (1.0 + 1e-6), "axis {axis}: {off} deg/s x frames after {k}");
        }
    }
}

#[test]
fn temperatures_are_encoded_and_limited() {
    for (centi, code) in
        [(2_500, 0x4B), (-5_000, 0), (-5_049, 0), (-9_000, 0), (i16::MIN, 0), (-50, 50), (-51, 49), (49, 50)]
    {
        assert_eq!(encode_temperature(Some(CentiCelsius(centi))), code, "{centi}");
    }
    for (centi, code) in [(15_000, 0xC8), (15_049, 0xC8), (15_050, 0xC9), (i16::MAX, 0xC9)] {
        assert_eq!(encode_temperature(Some(CentiCelsius(centi))), code, "{centi}");
    }
    assert_eq!(encode_temperature(None), 0xFF);
}
