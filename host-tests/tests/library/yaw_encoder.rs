//! Our own yaw messages: full resolution, exact integrals, protected.

use gyronet::can::e2e::{Checker, DataIdMode, P01, Profile, Verdict};
use gyronet::can::yaw::{
    AngleMessage, DetailMessage, Faults, LATENCY_UNKNOWN, RateMessage, SIGMA_UNKNOWN, YawError, encode_angle,
    encode_latency, encode_sigma,
};
use gyronet::can::yaw_encoder::YawEncoder;
use gyronet::estimate::YawEstimate;
use gyronet::units::{AngularRate, Yaw};
use gyronet_host_tests::synthetic::{deg_rate, estimate};

const PERIOD_S: f64 = 0.01;

fn p01() -> [Profile; 3] {
    [0x101, 0x102, 0x103].map(|data_id| Profile::P01(P01 { data_id, mode: DataIdMode::Both }))
}

/// The sum of the decoded rates times the period, the accumulated yaw as sent and as it is, deg.
fn integrate(rates: impl Iterator<Item = AngularRate>, every: u8) -> (f64, f64, f64) {
    let mut feed = YawEncoder::new(p01(), every);
    let (mut micro, mut yaw, mut turned) = (0i64, Yaw::default(), 0i64);
    let mut last = 0i32;
    for rate in rates {
        yaw.0 += i64::from(rate.0);
        if let Some([rate, angle, _]) = feed.encode(&estimate(rate, yaw)) {
            micro += i64::from(RateMessage::parse(&rate).expect("a rate message").rate);
            let code = AngleMessage::parse(&angle).expect("an angle message").yaw;
            // What a receiver does to get past the wrap.
            turned += i64::from(code.wrapping_sub(last));
            last = code;
        }
    }
    (
        micro as f64 * 1e-6 * PERIOD_S * f64::from(every),
        turned as f64 * 360.0 / 4_294_967_296.0,
        yaw.rad().to_degrees(),
    )
}

#[test]
fn a_period_of_several_samples_loses_nothing() {
    let wild = |k: i32| AngularRate((k.wrapping_mul(0x9E37_79B9_u32 as i32)) / 100);
    for every in [1, 2, 3, 5, 10] {
        let (sum, angle, yaw) = integrate((0..30_000).map(wild), every);
        // One LSB: the rounding and what the division leaves. The scale is 2.3e-10 too small.
        let bound = 1e-6 * PERIOD_S * f64::from(every) + 2.5e-10 * yaw.abs();
        assert!((sum - yaw).abs() <= bound, "{sum} {yaw}");
        assert!((angle - yaw).abs() <= 1e-7, "{angle} {yaw}");
    }
}

#[test]
fn many_turns_wrap_as_an_angle_does() {
    // 100 turns left, then 200 right, at 90 deg/s.
    let rates = (0..120_000).map(|k| deg_rate(if k < 40_000 { 90.0 } else { -90.0 }));
    let (sum, angle, yaw) = integrate(rates, 1);
    assert!((yaw + 36_000.0).abs() < 0.1, "{yaw}");
    assert!((angle - yaw).abs() < 1e-7, "{angle} {yaw}");
    assert!((sum - yaw).abs() < 2e-5, "{sum} {yaw}");
    // A half turn is the wrap itself.
    let half_turn = Yaw((core::f64::consts::PI * f64::from(1u32 << 27) * 100.0).round() as i64);
    assert_eq!(encode_angle(half_turn), i32::MIN);
    assert_eq!([Yaw(0), Yaw(-1)].map(encode_angle), [0, 0], "to the nearest code");
    let quarter = AngleMessage { yaw: encode_angle(Yaw(half_turn.0 / 2)), faults: Faults::NONE };
    assert!((quarter.deg() - 90.0).abs() < 1e-7);
}

#[test]
fn details_are_encoded_and_limited() {
    assert_eq!(RateMessage::parse(&[7; 8]), Err(YawError::Source(7)));
    assert_eq!(RateMessage::parse(&[0; 7]), Err(YawError::Length(7)));
    let mut feed = YawEncoder::new(p01(), 1);
    let detailed = YawEstimate {
        correction: deg_rate(-0.022),
        sigma: Some(deg_rate(0.02)),
        latency_us: Some(71_234),
        ..estimate(deg_rate(1.0), Yaw(0))
    };
    let [.., detail] = feed.encode(&detailed).expect("every sample");
    let detail = DetailMessage::parse(&detail).expect("a detail message");
    assert_eq!((detail.correction, detail.latency), (-110, 143));
    assert!([2000, 2001].contains(&detail.sigma), "{}", detail.sigma);
    assert_eq!(encode_sigma(Some(AngularRate(1))), 1, "a small error is not none");
    assert_eq!(encode_sigma(Some(AngularRate(0))), 0);
    assert_eq!(encode_sigma(Some(AngularRate(i32::MIN))), SIGMA_UNKNOWN - 1);
    assert_eq!(encode_sigma(None), SIGMA_UNKNOWN);
    assert_eq!(encode_latency(Some(u32::MAX)), LATENCY_UNKNOWN - 1);
    assert_eq!(encode_latency(None), LATENCY_UNKNOWN);
    let huge = YawEstimate { correction: AngularRate(i32::MIN), ..detailed };
    let [.., detail] = feed.encode(&huge).expect("every sample");
    assert_eq!(DetailMessage::parse(&detail).expect("a detail message").correction, -i16::MAX);
}

#[test]
fn messages_are_protected_and_belong_together() {
    let mut feed = YawEncoder::new(p01(), 1);
    let mut checkers = p01().map(|profile| Checker::new(profile, 1));
    for k in 0..300u16 {
        let messages = feed.encode(&estimate(deg_rate(5.0), Yaw(0))).expect("every sample");
        for (message, checker) in messages.iter().zip(&mut checkers) {
            let verdict = if k == 0 { Verdict::First } else { Verdict::Ok };
            assert_eq!(checker.check(message), Ok(verdict));
            assert_eq!(message[2], k as u8, "the sample counter");
        }
    }
}
