//! The CAN message TX1: published vectors, round trips, and a receiver that never loses an angle.

use gyronet::can::bosch::{
    OutOfRange, SignalStatus, Tx1, Tx1Error, YawRateSignal, encode_acceleration, encode_temperature,
};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{force, rate};

const G: f64 = 9.80665;
const DEG_PER_CODE: f64 = 180.0 / std::f64::consts::PI / (1u64 << 27) as f64;
/// Half an LSB of 0.005 deg/s for one period of 10 ms.
const HALF_LSB_DEG: f64 = 0.005 / 2.0 * 0.01;

/// Returns the message that a receiver reads for deg/s, g and a counter at 25 deg C.
fn tx1(deg_per_sec: f64, g: f64, counter: u8) -> Tx1 {
    let yaw_rate = YawRateSignal::default().encode(rate(deg_per_sec.to_radians())).expect("in range");
    let (lateral_acceleration, lateral_acceleration_status) = encode_acceleration(force(g * G));
    Tx1 {
        yaw_rate,
        yaw_rate_status: SignalStatus::OK,
        temperature: encode_temperature(Some(CentiCelsius(2_500))),
        lateral_acceleration,
        lateral_acceleration_status,
        counter,
    }
}

#[test]
fn frames_equal_vectors() {
    for (deg_per_sec, g, counter, bytes) in [
        (0.0, 0.0, 0, [0x00, 0x80, 0x00, 0x4B, 0x00, 0x80, 0x00, 0xD1]),
        (10.0, 0.1, 1, [0xD0, 0x87, 0x00, 0x4B, 0x11, 0x83, 0x01, 0x86]),
        (-12.345, -0.5, 15, [0x5B, 0x76, 0x00, 0x4B, 0xAD, 0x70, 0x0F, 0xEA]),
        (163.835, 4.0, 7, [0xFF, 0xFF, 0x00, 0x4B, 0x95, 0xFA, 0x07, 0x66]),
    ] {
        let message = tx1(deg_per_sec, g, counter);
        assert_eq!(message.emit(), bytes, "{deg_per_sec} deg/s");
        assert_eq!(Tx1::parse(&bytes), Ok(message));
        assert!((message.yaw_rate_deg_per_sec() - deg_per_sec).abs() < 1e-9);
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

#[test]
fn accelerations_are_encoded_and_limited() {
    for tenth_milli_g in -41_700..=41_700 {
        let g = f64::from(tenth_milli_g) * 1e-4;
        let force = force(g * G);
        let (code, status) = encode_acceleration(force);
        let exact = force.metre_per_sec2() / G / 0.000_127_465;
        // Half an LSB, and the scale's own rounding: 0.5 in 3,276,788, of 32,768 LSB.
        assert!((f64::from(code) - 32_768.0 - exact).abs() <= 0.505, "{g} g");
        assert_eq!(status, SignalStatus::OK);
    }
    assert_eq!(encode_acceleration(force(4.18 * G)), (0xFFFF, SignalStatus::FAILURE));
    assert_eq!(encode_acceleration(force(-4.18 * G)), (0, SignalStatus::FAILURE));
    assert_eq!(encode_acceleration(SpecificForce(i32::MAX)), (0xFFFF, SignalStatus::FAILURE));
    assert_eq!(encode_acceleration(SpecificForce(i32::MIN)), (0, SignalStatus::FAILURE));
}

/// Largest difference between a receiver's integral and the true one, deg, beyond what the
/// scale's own rounding (0.45 in 447,623,277) makes of the angle.
fn largest_integral_error(rates: impl Iterator<Item = AngularRate>) -> f64 {
    let mut signal = YawRateSignal::default();
    let (mut sent, mut received, mut largest) = (0i64, 0i64, 0.0f64);
    for rate in rates {
        sent += i64::from(rate.0);
        received += i64::from(signal.encode(rate).expect("in range")) - 0x8000;
        let exact = sent as f64 * DEG_PER_CODE * 0.01;
        largest = largest.max((received as f64 * 0.005 * 0.01 - exact).abs() - 1e-9 * exact.abs());
    }
    largest
}

#[test]
fn integral_is_never_off_by_more_than_half_a_step() {
    const FRAMES: usize = 60_000;
    let crawl = largest_integral_error(std::iter::repeat_n(rate(0.001f64.to_radians()), FRAMES));
    let mut noise = Noise::new(1);
    let random = std::iter::repeat_with(|| AngularRate(noise.int(-380_000_000, 380_000_000) as i32));
    let random = largest_integral_error(random.take(FRAMES));
    println!(
        "largest error of the integral: {crawl:.3e} deg at 0.001 deg/s, {random:.3e} deg at random rates"
    );
    // A part in a million for the arithmetic of this test.
    assert!(crawl <= HALF_LSB_DEG * (1.0 + 1e-6));
    assert!(random <= HALF_LSB_DEG * (1.0 + 1e-6));
}

#[test]
fn a_rate_beyond_the_range_is_marked_and_leaves_no_residual() {
    let mut signal = YawRateSignal::default();
    signal.encode(rate(0.0049f64.to_radians())).expect("in range");
    assert_eq!(signal.encode(rate(163.9f64.to_radians())), Err(OutOfRange(0xFFFF)));
    assert_eq!(signal.encode(AngularRate(0)), Ok(0x8000), "the residual of a bad frame is dropped");
    assert_eq!(signal.encode(rate(-163.9f64.to_radians())), Err(OutOfRange(0)));
    assert_eq!(signal.encode(AngularRate(i32::MAX)), Err(OutOfRange(0xFFFF)));
    assert_eq!(signal.encode(AngularRate(i32::MIN)), Err(OutOfRange(0)));
    assert_eq!(signal.encode(rate((-163.84f64).to_radians())), Ok(0));
}

#[test]
fn flips_of_one_and_two_bits_are_detected() {
    let bytes = tx1(-12.345, -0.5, 15).emit();
    let flip = |bytes: [u8; 8], bit: usize| {
        let mut bytes = bytes;
        bytes[bit / 8] ^= 1 << (bit % 8);
        bytes
    };
    for first in 0..64 {
        let once = flip(bytes, first);
        assert!(matches!(Tx1::parse(&once), Err(Tx1Error::Crc { .. })), "bit {first}");
        for second in 0..first {
            assert!(Tx1::parse(&flip(once, second)).is_err(), "bits {first} and {second}");
        }
    }
}
