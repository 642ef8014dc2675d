//! Our own yaw messages: full resolution, exact integrals, protected.

use gyronet::can::e2e::{Checker, DataIdMode, P01, Profile, Verdict};
use gyronet::can::yaw::{
    AngleMessage, DetailMessage, Faults, LATENCY_UNKNOWN, Quality, RATE_NOT_AVAILABLE, RateMessage,
    SIGMA_UNKNOWN, Source, YawError, encode_angle, encode_latency, encode_sigma,
};
use gyronet::can::yaw_encoder::YawEncoder;
use gyronet::estimate::YawEstimate;
use gyronet::health::{Status, judge};
use gyronet::units::{AngularRate, Yaw};
use proptest::prelude::*;

const PERIOD_S: f64 = 0.01;

fn p01() -> [Profile; 3] {
    [0x101, 0x102, 0x103].map(|data_id| Profile::P01(P01 { data_id, mode: DataIdMode::Both }))
}

fn rate(deg_per_sec: f64) -> AngularRate {
    AngularRate::from_rad_per_sec(deg_per_sec.to_radians() as f32).expect("in range")
}

fn sample(rate: AngularRate, yaw: Yaw) -> YawEstimate {
    YawEstimate { rate, yaw, source: Source::Model, quality: Quality::Good, ..YawEstimate::default() }
}

/// CanEncoder rates and keeps the accounts that the pipeline keeps; gives the sum of the decoded
/// rates times the period, the accumulated yaw as sent and as it is, in deg.
fn integrate(rates: impl Iterator<Item = AngularRate>, every: u8) -> (f64, f64, f64) {
    let mut feed = YawEncoder::new(p01(), every);
    let (mut micro, mut yaw, mut turned) = (0i64, Yaw::default(), 0i64);
    let mut last = 0i32;
    for rate in rates {
        yaw.0 += i64::from(rate.0);
        if let Some([rate, angle, _]) = feed.encode(&sample(rate, yaw)) {
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
    let rates = (0..120_000).map(|k| rate(if k < 40_000 { 90.0 } else { -90.0 }));
    let (sum, angle, yaw) = integrate(rates, 1);
    assert!((yaw + 36_000.0).abs() < 0.1, "{yaw}");
    assert!((angle - yaw).abs() < 1e-7, "{angle} {yaw}");
    assert!((sum - yaw).abs() < 2e-5, "{sum} {yaw}");
    // A half turn is the wrap itself.
    let half_turn = Yaw((core::f64::consts::PI * f64::from(1u32 << 27) * 100.0).round() as i64);
    assert_eq!(encode_angle(half_turn), i32::MIN);
    assert_eq!(encode_angle(Yaw(0)), 0);
    let quarter = AngleMessage { yaw: encode_angle(Yaw(half_turn.0 / 2)), faults: Faults::NONE };
    assert!((quarter.deg() - 90.0).abs() < 1e-7);
}

#[test]
fn a_rate_that_is_unusable_is_not_sent() {
    let mut feed = YawEncoder::new(p01(), 1);
    let (source, quality) = judge(Status::Clipped);
    let clipped = YawEstimate { source, quality, faults: Faults::CLIPPED, ..sample(rate(500.0), Yaw(0)) };
    let [message, angle, _] = feed.encode(&clipped).expect("every sample");
    let message = RateMessage::parse(&message).expect("a rate message");
    assert_eq!(message.rate, RATE_NOT_AVAILABLE);
    assert_eq!(message.deg_per_sec(), None);
    assert_eq!(AngleMessage::parse(&angle).expect("an angle message").faults, Faults::CLIPPED);
    assert_eq!(judge(Status::Init), (Source::Raw, Quality::Initialising));
    assert_eq!(judge(Status::Degraded), (Source::Static, Quality::Degraded));
    assert_eq!(judge(Status::Ready), (Source::Model, Quality::Good));
}

#[test]
fn every_judgement_is_read_as_it_was_sent() {
    for source in [Source::Raw, Source::Static, Source::Model, Source::EarthRate] {
        for quality in [Quality::Good, Quality::Degraded, Quality::Initialising, Quality::Unusable] {
            let message = RateMessage { rate: -7, source, quality };
            assert_eq!(RateMessage::parse(&message.emit()), Ok(message));
        }
    }
    assert_eq!(RateMessage::parse(&[7; 8]), Err(YawError::Source(7)));
    assert_eq!(RateMessage::parse(&[0; 7]), Err(YawError::Length(7)));
}

#[test]
fn a_fault_between_two_messages_is_not_lost() {
    let mut feed = YawEncoder::new(p01(), 3);
    let with = |faults| YawEstimate { faults, ..sample(AngularRate::ZERO, Yaw(0)) };
    assert_eq!(feed.encode(&with(Faults::GAP)), None);
    assert_eq!(feed.encode(&with(Faults::NONE)), None);
    let [_, angle, _] = feed.encode(&with(Faults::LATE)).expect("third sample");
    let faults = AngleMessage::parse(&angle).expect("an angle message").faults;
    assert_eq!(faults, Faults::GAP.with(Faults::LATE));
}

#[test]
fn details_are_encoded_and_limited() {
    let mut feed = YawEncoder::new(p01(), 1);
    let detailed = YawEstimate {
        correction: rate(-0.022),
        sigma: Some(rate(0.02)),
        latency_us: Some(71_234),
        ..sample(rate(1.0), Yaw(0))
    };
    let [.., detail] = feed.encode(&detailed).expect("every sample");
    let detail = DetailMessage::parse(&detail).expect("a detail message");
    assert_eq!((detail.correction, detail.latency), (-110, 143));
    assert_eq!(detail.latency_ms(), Some(71.5));
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
        let messages = feed.encode(&sample(rate(5.0), Yaw(0))).expect("every sample");
        for (message, checker) in messages.iter().zip(&mut checkers) {
            let verdict = if k == 0 { Verdict::First } else { Verdict::Ok };
            assert_eq!(checker.check(message), Ok(verdict));
            assert_eq!(message[2], k as u8, "the sample counter");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn an_expected_error_is_rounded_up_and_by_less_than_an_lsb(code in 0..1_535_000i32) {
        let mut feed = YawEncoder::new(p01(), 1);
        let sigma = Some(AngularRate(code));
        let [.., detail] = feed.encode(&YawEstimate { sigma, ..sample(rate(5.0), Yaw(0)) }).expect("every sample");
        let sent = f64::from(DetailMessage::parse(&detail).expect("a detail message").sigma);
        let beyond = sent - AngularRate(code).rad_per_sec().to_degrees() * 1e5;
        prop_assert!((-1e-3..1.001).contains(&beyond), "{code}: {beyond} LSB");
    }

    /// Every single rate is within one LSB of the truth, whatever came before.
    #[test]
    fn rates_are_never_further_off_than_an_lsb(codes in proptest::collection::vec(any::<i32>(), 1..200)) {
        let mut feed = YawEncoder::new(p01(), 1);
        for code in codes {
            let [message, ..] = feed.encode(&sample(AngularRate(code), Yaw(0))).expect("every sample");
            let sent = RateMessage::parse(&message).expect("a rate message").deg_per_sec();
            let due = AngularRate(code).rad_per_sec().to_degrees();
            prop_assert!((sent.expect("good") - due).abs() < 1.3e-6);
        }
    }
}
