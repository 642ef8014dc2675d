//! Validity travels: what is summed, averaged or carried is worth no more than the worst of what went in.

use gyronet::can::e2e::{DataIdMode, P01, Profile};
use gyronet::can::yaw::{AngleMessage, DetailMessage, RATE_NOT_AVAILABLE, RateMessage, SIGMA_UNKNOWN};
use gyronet::can::yaw_encoder::YawEncoder;
use gyronet::estimate::YawEstimate;
use gyronet::health::{Faults, Quality, Source, Status, judge};
use gyronet::model::window::WINDOW;
use gyronet::pipeline::{Output, Pipeline, PipelineConfig};
use gyronet::sample::{PERIOD_US, Validity};
use gyronet::units::AngularRate;
use gyronet_host_tests::stream::{constant, drive, run};
use gyronet_host_tests::synthetic::rate;

/// Every validity but [`Validity::Good`], with its status and fault.
const BAD: [(Validity, Status, Faults); 4] = [
    (Validity::Saturated, Status::Clipped, Faults::CLIPPED),
    (Validity::Recovering, Status::Clipped, Faults::CLIPPED),
    (Validity::Stuck, Status::Stuck, Faults::STUCK),
    (Validity::Implausible, Status::Clipped, Faults::IMPLAUSIBLE),
];
/// The samples with a bad reading.
const FROM: u64 = 500;
const UNTIL: u64 = 520;
/// Delay of the delayed rate, samples.
const LAG: u64 = 7;
/// 0.01 deg.
const CODE: f64 = 1.745_329e-4;

/// A vehicle that turns at 0.249 rad/s beyond its bias, with readings of 12 rad/s that are marked.
fn turned(validity: Validity) -> (Vec<Output>, f64) {
    let samples = drive(0..900).map(|mut sample| {
        if (FROM * PERIOD_US..UNTIL * PERIOD_US).contains(&sample.time.0) {
            sample.validity = validity;
            sample.angular_rate[2] = if validity.is_good() { sample.angular_rate[2] } else { rate(12.0) };
        }
        sample
    });
    // A bias beyond doubt: what it may hide would be more than the gap.
    let mut pipeline = Pipeline::new(PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT });
    let outputs = run(&mut pipeline, samples, constant(0.0));
    let bad = if validity.is_good() { 0 } else { UNTIL - FROM };
    assert_eq!(u64::from(pipeline.counters().invalid), bad, "{validity:?}");
    let status = pipeline.status(None);
    assert_eq!(status.gaps, Some(u32::from(bad > 0)), "{validity:?}");
    (outputs, f64::from(status.doubt.expect("it has begun")) * CODE)
}

#[test]
fn a_bad_reading_is_summed_nowhere_and_leaves_with_its_fault() {
    let (good, expected) = turned(Validity::Good);
    let step = 0.249 * 0.01;
    for (validity, status, fault) in BAD {
        let (outputs, doubt) = turned(validity);
        // Readings before the first repeated one that is found repeat it, too.
        let first = if validity == Validity::Stuck { FROM - 6 } else { FROM };
        for (tick, output) in (0u64..).zip(&outputs) {
            let (live, delayed) = (&output.vehicle.live, &output.vehicle.delayed);
            let why = format!("{validity:?}, sample {tick}");
            let is_bad = (FROM..UNTIL).contains(&tick);
            assert_eq!((live.status == status, live.faults == fault), (is_bad, is_bad), "{why}");
            let is_bad = (first..UNTIL).contains(&u64::from(delayed.tick)) && tick >= FROM;
            assert_eq!((delayed.status == status, delayed.faults == fault), (is_bad, is_bad), "{why}");
            assert_eq!(delayed.sigma.is_none(), is_bad || delayed.status == Status::Init, "{why}");
            assert!(!is_bad || (delayed.source, delayed.quality) == judge(status), "{why}");
            let window = (FROM..UNTIL + WINDOW as u64 - 1).contains(&tick);
            assert!(!(window && output.window.is_some()), "{why}: a window over it");
        }
        let yaw = |outputs: &[Output], tick: u64| outputs[tick as usize].vehicle.delayed.yaw.rad();
        let held = yaw(&outputs, first + LAG - 1);
        assert_eq!(yaw(&outputs, UNTIL + LAG - 1), held, "{validity:?}: the yaw keeps its value");
        assert!(yaw(&outputs, UNTIL + LAG) > held, "{validity:?}: and goes on");
        let lost = yaw(&good, 899) - yaw(&outputs, 899);
        let due = (UNTIL - first) as f64 * step;
        assert!((lost - due).abs() < 0.1 * step, "{validity:?}: {lost} lost of {due}");
        // It is what the doubt has grown by, with what the rate may have done meanwhile.
        let grown = (doubt * doubt - expected * expected).sqrt();
        let hidden = if validity == Validity::Stuck { 0.3 * 0.249 + 0.05 } else { 0.012 };
        assert!((lost..lost + hidden).contains(&grown), "{validity:?}: {grown} for {lost}");
    }
}

fn encoder(every: u8) -> YawEncoder {
    let profile = |data_id| Profile::P01(P01 { data_id, mode: DataIdMode::Both });
    YawEncoder::new([1, 2, 3].map(profile), every)
}

fn good(rad_per_sec: f64) -> YawEstimate {
    let (source, quality) = judge(Status::Ready);
    let sigma = Some(rate(1e-4));
    YawEstimate {
        rate: rate(rad_per_sec),
        sigma,
        status: Status::Ready,
        source,
        quality,
        ..YawEstimate::default()
    }
}

fn with(status: Status, sigma: Option<AngularRate>) -> YawEstimate {
    let (source, quality) = judge(status);
    YawEstimate { sigma, status, source, quality, ..good(0.5) }
}

fn set(samples: &[YawEstimate]) -> (RateMessage, AngleMessage, DetailMessage) {
    let mut encoder = encoder(samples.len() as u8);
    let sets: Vec<_> = samples.iter().filter_map(|sample| encoder.encode(sample)).collect();
    let [[rate, angle, detail]] = &sets[..] else { panic!("one set") };
    let parsed = (RateMessage::parse(rate), AngleMessage::parse(angle), DetailMessage::parse(detail));
    (parsed.0.expect("a rate"), parsed.1.expect("an angle"), parsed.2.expect("details"))
}

/// A second of which 0.99 s are silent.
#[test]
fn a_mean_with_a_silent_sample_is_not_available() {
    let silent = YawEstimate { sigma: None, faults: Faults::GAP, ..with(Status::Silent, None) };
    for at in [0, 50, 99] {
        let mut samples = [YawEstimate { rate: rate(0.0), ..silent }; 100];
        samples[at] = good(0.5);
        let (message, angle, detail) = set(&samples);
        assert_eq!((message.rate, message.quality), (RATE_NOT_AVAILABLE, Quality::Unusable), "{at}");
        assert_eq!((angle.faults, detail.sigma, message.source), (Faults::GAP, SIGMA_UNKNOWN, Source::Raw));
        samples = [good(0.5); 100];
        samples[at] = silent;
        assert_eq!(set(&samples).0.rate, RATE_NOT_AVAILABLE, "{at}");
    }
}

#[test]
fn a_mean_has_the_worst_quality_and_the_largest_sigma_in_any_order() {
    let sigma = |k: usize| rate(1e-4 * (k + 1) as f64);
    // From best to worst.
    let statuses = [Status::Ready, Status::Degraded, Status::Init, Status::Clipped];
    for k in 0..64 {
        let chosen = [k % 4, k / 4 % 4, k / 16];
        let samples = chosen.map(|k| with(statuses[k], Some(sigma(k))));
        let worst = chosen.into_iter().max().expect("three");
        let (message, _, detail) = set(&samples);
        assert_eq!((message.source, message.quality), judge(statuses[worst]), "{chosen:?}");
        let due = sigma(worst).rad_per_sec().to_degrees() * 1e5;
        assert!((f64::from(detail.sigma) - due).abs() <= 1.0, "{chosen:?}");
    }
    let unknown = set(&[good(0.1), with(Status::Ready, None), good(0.1)]);
    assert_eq!(unknown.2.sigma, SIGMA_UNKNOWN);
}

/// Neither the sum nor its rounding residual outlives a mean that may not be used, nor that of a limited correction: a
/// code is 0.43 LSB of the rate, two of them round to one.
#[test]
fn a_mean_that_may_not_be_used_leaves_nothing_to_the_next() {
    for (status, due) in [(Status::Ready, 1), (Status::Init, 0), (Status::Clipped, 0)] {
        let mut encoder = encoder(1);
        let mut send = |sample| encoder.encode(&sample).map(|[rate, ..]| RateMessage::parse(&rate));
        let code = AngularRate(1);
        send(YawEstimate { rate: code, ..with(status, None) });
        let next = send(YawEstimate { rate: code, ..good(0.0) }).expect("a set").expect("a rate");
        assert_eq!(next.rate, due, "{status:?}");
    }
    // LSB of 0.2 mdeg/s, and what is left of them.
    for (first, due) in [(100.4, 1), (40_000.4, 0)] {
        let mut encoder = encoder(1);
        let correction = |lsb: f64| YawEstimate { correction: rate((lsb * 2e-4).to_radians()), ..good(0.0) };
        encoder.encode(&correction(first));
        let [.., detail] = encoder.encode(&correction(0.2)).expect("a set");
        assert_eq!(DetailMessage::parse(&detail).expect("details").correction, due, "{first}");
    }
}
