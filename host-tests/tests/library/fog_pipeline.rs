//! A fibre-optic gyro's messages: what they say of gaps, and of what is missing.

use gyronet::bias::Latitude;
use gyronet::estimate::YawEstimate;
use gyronet::fog::{FogConfig, FogPipeline};
use gyronet::health::{Faults, Quality, Source};
use gyronet::sample::{FogSample, PERIOD_US, Standstill, WheelSample};
use gyronet::units::{Angle, Micros, WheelSpeed, Yaw};

/// Codes that the gyro turns in 10 ms.
const TURN: i64 = 1 << 40;

/// A gyro at the equator, where the Earth's rate adds nothing.
fn fog() -> FogPipeline {
    let config = FogConfig { latitude: Latitude::from_degrees(0.0), ..FogConfig::DEFAULT };
    let mut fog = FogPipeline::new(config, false);
    // Another gyro has agreed in a turn.
    fog.confirm();
    fog
}

fn sample(step: u64) -> FogSample {
    FogSample {
        time: Micros(step * PERIOD_US),
        span: PERIOD_US as u32,
        lost: 0,
        // It has noise.
        increment: [None, None, Some(Angle(TURN + (step % 2) as i64))],
        temperature: None,
    }
}

fn wheels() -> WheelSample {
    WheelSample { time: Micros(0), speeds: [Some(WheelSpeed(1_000)); 4], standstill: Standstill::Moving }
}

/// Steps of 10 ms; `with` says whether the gyro sends in one.
fn run(fog: &mut FogPipeline, steps: core::ops::Range<u64>, with: impl Fn(u64) -> bool) -> Vec<YawEstimate> {
    let mut sent = Vec::new();
    for step in steps {
        let now = Micros(step * PERIOD_US);
        if with(step) {
            fog.add(now, sample(step)).expect("in order");
        }
        while let Some(yaw) = fog.next_step(now, Some(&wheels())) {
            sent.push(yaw);
        }
    }
    sent
}

#[test]
fn a_gap_is_no_rate() {
    let mut fog = fog();
    let sent = run(&mut fog, 1..501, |step| !(301..306).contains(&step));
    let gap: Vec<_> = sent.iter().filter(|yaw| yaw.quality == Quality::Unusable).collect();
    assert!((5..=6).contains(&gap.len()), "{}", gap.len());
    assert!(gap.iter().all(|yaw| yaw.faults.0 & Faults::GAP.0 != 0 && yaw.rate.0 == 0));
    let others = sent.iter().filter(|yaw| yaw.quality != Quality::Unusable);
    assert!(others.clone().all(|yaw| (yaw.source, yaw.quality) == (Source::EarthRate, Quality::Good)));
    // The yaw is the sum of the rates.
    let sum = others.map(|yaw| i64::from(yaw.rate.0)).sum::<i64>();
    assert_eq!(sent.last().map(|yaw| yaw.yaw), Some(Yaw(sum)));
}

/// On the grid and between: an increment that straddles two steps is in both, so that the one that holds the end of the last
/// equal increment is stuck, too.
#[test]
fn a_gyro_that_says_the_same_is_stuck() {
    for offset in [0, PERIOD_US / 2] {
        let (mut fog, mut sent) = (fog(), Vec::new());
        for step in 1..700 {
            let now = Micros(step * PERIOD_US + offset);
            // From step 301 on it repeats what it said in step 300.
            let said = if (301..351).contains(&step) { 300 } else { step };
            fog.add(now, FogSample { time: now, ..sample(said) }).expect("in order");
            sent.extend(std::iter::from_fn(|| fog.next_step(now, Some(&wheels()))));
        }
        // The first steps between have no increment before them.
        let sent = if offset > 0 { &sent[10..] } else { &sent[..] };
        let stuck = |yaw: &YawEstimate| yaw.faults.contains(Faults::STUCK);
        let [first, last] = [sent.iter().position(stuck), sent.iter().rposition(stuck)].map(Option::unwrap);
        if offset == 0 {
            // The fifth equal turn is that of step 304; step 351 differs.
            assert_eq!((first, last), (303, 349));
            assert_eq!((fog.counters.stuck, fog.counters.gaps), (1, 47));
        }
        assert!((45..=50).contains(&(last - first)), "{first} to {last}");
        for (step, yaw) in sent.iter().enumerate() {
            let is_stuck = (first..=last).contains(&step);
            assert_eq!((stuck(yaw), yaw.quality == Quality::Unusable), (is_stuck, is_stuck), "{step}");
            assert!(!yaw.faults.contains(Faults::GAP) && (!is_stuck || yaw.rate.0 == 0), "{step}");
        }
        let after = &sent[last + 1];
        assert_eq!((after.source, after.quality), (Source::EarthRate, Quality::Good));
        assert_eq!(sent.last().map(|yaw| (yaw.source, yaw.faults)), Some((Source::EarthRate, Faults::NONE)));
    }
}

/// A gyro whose messages cover half of each 10 ms.
#[test]
fn a_step_that_is_partly_covered_has_no_rate() {
    let mut fog = fog();
    run(&mut fog, 1..101, |_| true);
    for step in 101..201 {
        let now = Micros(step * PERIOD_US);
        let half = FogSample { span: PERIOD_US as u32 / 2, lost: 1, ..sample(step) };
        fog.add(now, half).expect("in order");
        let yaw = fog.next_step(now, Some(&wheels())).expect("a step");
        assert_eq!((yaw.rate.0, yaw.quality), (0, Quality::Unusable), "step {step}");
        assert!(yaw.faults.0 & Faults::GAP.0 != 0, "step {step}");
    }
}

/// Where the board's clock is exact, a gyro's clock that is 1 % fast turns nothing; before it is measured, sigma says so.
#[test]
fn a_clock_that_is_off_is_expected_until_it_is_measured() {
    let config =
        FogConfig { latitude: Latitude::from_degrees(0.0), clock_is_exact: true, ..FogConfig::DEFAULT };
    let mut fog = FogPipeline::new(config, false);
    fog.confirm();
    let mut sent = Vec::new();
    for step in 1..4_001 {
        let now = Micros(step * (PERIOD_US - PERIOD_US / 100));
        fog.add(now, sample(step)).expect("in order");
        sent.extend(std::iter::from_fn(|| fog.next_step(now, Some(&wheels()))));
    }
    let rate = 100.0 * TURN as f64 / f64::from(Angle::PER_RAD);
    let mean = |sent: &[YawEstimate]| {
        let sum = |of: fn(&YawEstimate) -> f64| sent.iter().map(of).sum::<f64>() / sent.len() as f64 / rate;
        [sum(|yaw| yaw.rate.rad_per_sec()), sum(|yaw| yaw.sigma.expect("known").rad_per_sec())]
    };
    let ([before, expected], [after, known]) = (mean(&sent[200..500]), mean(&sent[3_000..]));
    assert!((before - 1.0 / 0.99).abs() < 1e-3 && (0.009..0.02).contains(&expected), "{before} {expected}");
    assert!((after - 1.0).abs() < 2e-4 && known < expected - 5e-3, "{after} {known}");
}
