//! A fibre-optic gyro's messages: what they say of its correction, of gaps, and of what is missing.

use gyronet::fog::FogConfig;
use gyronet::fog::lane::FogLane;
use gyronet::health::{Faults, Quality, Source};
use gyronet::model::fognet::FogEstimate;
use gyronet::sample::{FogSample, PERIOD_US, Standstill, WheelSample};
use gyronet::units::{Angle, Micros, WheelSpeed, Yaw};
use gyronet::vehicle::YawSample;

/// Codes that the gyro turns in 10 ms.
const TURN: i64 = 1 << 40;
const NOTHING: FogEstimate =
    FogEstimate { correction: Angle(600_000_000), linear: Angle::ZERO, gain: 0, clamped_inputs: 0 };

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

/// Steps of 10 ms; `with` says whether the gyro sends in one. What is due is answered at once.
fn run(lane: &mut FogLane, steps: core::ops::Range<u64>, with: impl Fn(u64) -> bool) -> Vec<YawSample> {
    let mut sent = Vec::new();
    for step in steps {
        let now = Micros(step * PERIOD_US);
        if with(step) {
            lane.push(now, sample(step));
        }
        while let Some(yaw) = lane.next_step(now, Some([0; 6]), Some(&wheels())) {
            sent.push(yaw);
        }
        if let Some((number, _)) = lane.window() {
            lane.deliver(number, NOTHING);
        }
    }
    sent
}

#[test]
fn corrected_when_an_estimate_is_in_use() {
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    let sent = run(&mut lane, 1..401, |_| true);
    assert_eq!(sent.len(), 400);
    // A window after the first second, its estimate after the second one.
    let first = sent.iter().position(|yaw| yaw.source == Source::FogNet);
    assert_eq!(first, Some(200));
    assert!(sent[..200].iter().all(|yaw| (yaw.source, yaw.quality) == (Source::Raw, Quality::Degraded)));
    assert!(sent[200..].iter().all(|yaw| yaw.quality == Quality::Good && yaw.faults == Faults::NONE));
    // The yaw is the sum of the rates.
    let sum = sent.iter().map(|yaw| i64::from(yaw.rate.0)).sum::<i64>();
    assert_eq!(sent[399].yaw, Yaw(sum));
    assert_eq!((lane.counters().windows, lane.counters().late, lane.counters().gaps), (3, 0, 0));
}

#[test]
fn a_gap_is_no_rate_and_ends_the_window() {
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    let sent = run(&mut lane, 1..501, |step| !(301..306).contains(&step));
    let gap: Vec<_> = sent.iter().filter(|yaw| yaw.quality == Quality::Unusable).collect();
    assert!((5..=6).contains(&gap.len()), "{}", gap.len());
    assert!(gap.iter().all(|yaw| yaw.faults.0 & Faults::GAP.0 != 0 && yaw.rate.0 == 0));
    // Not by the estimate from before it.
    let behind = sent.iter().rposition(|yaw| yaw.quality == Quality::Unusable).expect("a gap") + 1;
    assert_eq!(sent[behind].source, Source::Raw);
    assert!(lane.counters().broken > 0);
}

#[test]
fn a_gyro_that_says_the_same_is_stuck() {
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    let mut sent = run(&mut lane, 1..301, |_| true);
    // From step 301 on it repeats what it said in step 300.
    for step in 301..351 {
        lane.push(Micros(step * PERIOD_US), FogSample { time: Micros(step * PERIOD_US), ..sample(300) });
        let yaw = lane.next_step(Micros(step * PERIOD_US), Some([0; 6]), Some(&wheels())).expect("a step");
        sent.push(yaw);
    }
    sent.extend(run(&mut lane, 351..700, |_| true));
    let stuck = |yaw: &YawSample| yaw.faults.0 & Faults::STUCK.0 != 0;
    // The fifth equal turn is that of step 304; step 351 differs.
    assert_eq!(sent.iter().position(stuck), Some(303));
    assert_eq!(sent.iter().rposition(stuck), Some(349));
    let during = &sent[303..350];
    assert!(during.iter().all(|yaw| stuck(yaw) && yaw.quality == Quality::Unusable && yaw.rate.0 == 0));
    // The window has to begin anew.
    assert_eq!((sent[350].source, sent[350].quality), (Source::Raw, Quality::Degraded));
    assert_eq!(sent.last().map(|yaw| (yaw.source, yaw.faults)), Some((Source::FogNet, Faults::NONE)));
    assert_eq!((lane.counters().stuck, lane.counters().gaps), (1, 47));
}

#[test]
fn a_gyro_that_is_expected_is_missed_from_the_start() {
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    assert_eq!(run(&mut lane, 0..101, |_| false), []);
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    lane.expect(Micros(0));
    let sent = run(&mut lane, 0..501, |step| step > 100);
    // Step 0 is due 10 ms on; each of silence is no rate.
    assert_eq!(sent.len(), 501);
    let silent = sent.iter().take_while(|yaw| yaw.quality == Quality::Unusable).count();
    assert!((100..=102).contains(&silent), "{silent}");
    assert!(sent[..silent].iter().all(|yaw| yaw.faults.0 & Faults::GAP.0 != 0 && yaw.rate.0 == 0));
    // Then all is as if it had been heard from the start.
    assert_eq!(sent.last().map(|yaw| (yaw.source, yaw.faults)), Some((Source::FogNet, Faults::NONE)));
    assert_eq!(lane.counters().gaps as usize, silent);
}

#[test]
fn what_is_missing_is_said() {
    let mut lane = FogLane::new(FogConfig::DEFAULT, false);
    let sent = run(&mut lane, 1..301, |_| true);
    assert!(sent.iter().all(|yaw| yaw.source == Source::Raw && yaw.faults == Faults::STORED));
    assert!(lane.window().is_none());
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    lane.push(Micros(PERIOD_US), sample(1));
    let yaw = lane.next_step(Micros(PERIOD_US), Some([0; 6]), None).expect("a step");
    assert_eq!(yaw.faults, Faults::WHEELS);
    // Nobody runs the window in time.
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    let mut late = 0;
    for step in 1..251 {
        lane.push(Micros(step * PERIOD_US), sample(step));
        let yaw = lane.next_step(Micros(step * PERIOD_US), Some([0; 6]), Some(&wheels())).expect("a step");
        late += u32::from(yaw.faults == Faults::LATE && yaw.source == Source::Raw);
    }
    assert_eq!((late, lane.counters().late), (51, 1));
}

#[test]
fn nothing_is_sent_of_a_gyro_that_was_never_heard() {
    let mut lane = FogLane::new(FogConfig::DEFAULT, true);
    assert!(run(&mut lane, 1..101, |_| false).is_empty());
}
