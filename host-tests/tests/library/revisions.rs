//! No angle is lost between the network's revised estimates and the rates on the bus: sums kept
//! beside the pipeline, exact to the last code.

use gyronet::compensate::{CompensateConfig, Compensator, Lag, MAX_MEAN, Remaining, Stride};
use gyronet::health::Status;
use gyronet::model::Estimate;
use gyronet::model::window::WINDOW;
use gyronet::pipeline::{BoardState, Pipeline, PipelineConfig};
use gyronet::sample::{ImuSample, Validity};
use gyronet::units::{AngularRate, Yaw};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{idling, rate};
use std::collections::BTreeMap;

/// The sum that the emitted rates must have, from the estimates alone.
#[derive(Default)]
struct Ledger {
    samples: BTreeMap<u32, Sample>,
    /// The constant that is taken out of the corrections, Q16, and the windows that it is the mean of.
    constant: (i64, i64),
    out: Option<(u32, [i64; WINDOW])>,
    /// Sums of the rates that went out.
    live: i64,
    delayed: i64,
}

struct Sample {
    /// Gyro less bias.
    gyro: i64,
    clipped: bool,
    estimates: Vec<i64>,
}

impl Sample {
    fn estimate(&self) -> i64 {
        self.estimates.iter().sum::<i64>().checked_div(self.estimates.len() as i64).unwrap_or(0)
    }
}

impl Ledger {
    /// The best rates of all samples as known now, summed.
    fn best(&self) -> i64 {
        let usable = self.samples.values().filter(|sample| !sample.clipped);
        usable.map(|sample| sample.gyro - sample.estimate()).sum()
    }

    fn take_estimate(&mut self, tick: u32, stride: Stride) {
        let Some((end, estimate)) = self.out.take_if(|(end, _)| tick >= *end + stride.delay()) else {
            return;
        };
        let mean = |values: &[i64]| values.iter().sum::<i64>() / values.len() as i64;
        if mean(&estimate).abs() > MAX_MEAN.0.into() {
            return;
        }
        let covered = self.samples.range_mut(end + 1 - WINDOW as u32..=end);
        let mut window: Vec<(&mut Sample, i64)> = covered.map(|(_, sample)| sample).zip(estimate).collect();
        assert_eq!(window.len(), WINDOW, "windows cover samples that went out");
        let sum: i64 = window.iter().map(|(_, estimate)| estimate).sum();
        let (constant, windows) = &mut self.constant;
        *windows = (*windows + 1).min(1_280 / i64::from(stride.samples()));
        *constant += ((sum / WINDOW as i64 * 65_536) - *constant) / *windows;
        for (sample, estimate) in &mut window {
            sample.estimates.push(*estimate - (*constant >> 16));
        }
    }
}

#[derive(Clone, Copy)]
struct Faults {
    gaps: bool,
    clipping: bool,
    /// Spread of a window's estimates, and of their mean, rad/s.
    spread: f64,
}

/// 30 s with the ledger checked about five times a second; returns how often the revisions of a rate were bounded
/// and how many samples were complete.
fn check(compensate: CompensateConfig, faults: Faults, seed: u64) -> (u32, u32) {
    let CompensateConfig { stride, lag, max_revision, .. } = compensate;
    let mut noise = Noise::new(seed);
    let config = PipelineConfig { compensate, zero_rate: None, ..PipelineConfig::DEFAULT };
    let mut pipeline = Pipeline::new(config);
    let mut ledger = Ledger::default();
    let (mut tick, mut bounded, mut ready, mut complete) = (0u64, 0, 0, 0);
    let bound = i64::from(max_revision.0);
    while tick < 3_000 {
        let moving = tick > 400;
        tick += if moving && faults.gaps && noise.int(0, 99) == 0 { noise.int(2, 9) as u64 } else { 1 };
        let clipped = moving && faults.clipping && noise.int(0, 99) == 0;
        let mut sample =
            ImuSample { validity: Validity::reported(clipped), ..idling(tick, 0.003, &mut noise) };
        sample.angular_rate[2].0 += if moving { rate(0.4).0 } else { 0 };
        let broken = ledger.samples.last_key_value().map(|(last, _)| *last);
        let output = pipeline.correct(sample, None, &BoardState::GOOD).expect("a place on the grid");
        let (live, delayed) = (output.vehicle.live, output.vehicle.delayed);
        let Some(bias) = pipeline.gyro_bias().filter(|_| live.status != Status::Init) else {
            continue;
        };
        if clipped || broken.is_some_and(|last| live.tick != last + 1) {
            ledger.out = None;
        }
        ledger.take_estimate(live.tick, stride);
        let gyro = i64::from(sample.angular_rate[2].0 - bias[2].0);
        ledger.samples.insert(live.tick, Sample { gyro, clipped, estimates: Vec::new() });
        let usable = |status| status != Status::Init && status != Status::Clipped;
        ledger.live += if usable(live.status) { i64::from(live.rate.0) } else { 0 };
        ledger.delayed += if usable(delayed.status) { i64::from(delayed.rate.0) } else { 0 };
        if noise.int(0, 19) == 0 {
            let Yaw(pending) = pipeline.pending();
            assert_eq!(ledger.delayed + pending, ledger.best(), "at tick {}", live.tick);
        }
        assert_eq!((live.yaw.0, delayed.yaw.0), (ledger.live, ledger.delayed));
        if let Some(complete_now) = output.complete {
            let sample = &ledger.samples[&complete_now.tick];
            assert_eq!(i64::from(complete_now.correction.0), sample.estimate());
            complete += u32::from(complete_now.good);
        }
        assert_eq!(i64::from(live.rate.0), gyro, "no window corrects a live rate");
        if delayed.status != Status::Init {
            let sample = &ledger.samples[&delayed.tick];
            let carried = sample.gyro - sample.estimate() - i64::from(delayed.rate.0);
            assert!(carried.abs() <= bound, "one rate carries {carried}");
            assert!(!sample.clipped || carried == 0, "a receiver drops the rate of a clipped sample");
            bounded += u32::from(carried.abs() == bound);
        }
        let late = ledger.samples.range(delayed.tick..).count() - 1;
        assert_eq!(late, if delayed.status == Status::Init { 0 } else { lag.samples() });
        ready += u32::from(delayed.status == Status::Ready);
        if let Some(due) = output.window {
            let mean = faults.spread * noise.normal();
            let corrections = [(); WINDOW].map(|()| rate(mean + faults.spread * noise.normal()));
            ledger.out = Some((due.end, corrections.map(|c| c.0.into())));
            pipeline.deliver(due.end, Estimate { corrections, ..Estimate::NONE });
        }
    }
    assert!(ready > 1_000, "only {ready} samples were corrected");
    (bounded, complete)
}

fn configs() -> impl Iterator<Item = CompensateConfig> {
    let lags = [0, 2, 7, 11].into_iter().filter_map(Lag::new);
    let with = |stride, lag| CompensateConfig { stride, lag, ..CompensateConfig::DEFAULT };
    let strides = [1, 3, 5, 10].into_iter().filter_map(Stride::new);
    strides.flat_map(move |stride| lags.clone().map(move |lag| with(stride, lag)))
}

const CALM: Faults = Faults { gaps: false, clipping: false, spread: 0.0002 };

#[test]
fn the_sum_of_a_clean_stream_is_that_of_the_estimates() {
    for config in configs() {
        let (bounded, complete) = check(config, CALM, 1);
        assert_eq!(bounded, 0, "nothing here needs the bound");
        // What comes before the first used output has no estimate, and the last are under way.
        let without = config.stride.complete_after();
        assert_eq!(complete as usize, 3_000 - 300 - without, "{config:?}");
    }
}

#[test]
fn gaps_clipping_and_implausible_windows_lose_no_revision() {
    for (seed, config) in (2..).zip(configs()) {
        check(config, Faults { gaps: true, clipping: true, spread: 0.03 }, seed);
    }
}

#[test]
fn bounded_revisions_are_spread_and_not_lost() {
    // A rate that is sent once its sample is complete is never revised.
    for config in configs().filter(|config| config.lag.samples() < config.stride.complete_after()) {
        let tight = CompensateConfig { max_revision: AngularRate(2_000), ..config };
        let bounded = [CALM, Faults { gaps: true, clipping: true, spread: 0.02 }]
            .map(|faults| check(tight, faults, 7).0);
        assert!(bounded.iter().all(|bounded| *bounded > 1_000), "{config:?}: {bounded:?}");
    }
}

/// A window may change the estimate of a sample whose rate has gone out as zero: then what standing took off it
/// changes.
#[test]
fn a_revision_while_the_vehicle_stands_is_given_back_when_it_moves() {
    const ALL: u32 = 400;
    let (mut compensator, mut noise) = (Compensator::new(CompensateConfig::DEFAULT), Noise::new(9));
    let (mut sent, mut best, mut complete) = (0, 0, 0);
    for tick in 0..ALL {
        // The last estimates are known by then: those of the samples that follow are zero.
        if (20..350).contains(&tick) && tick % 5 == 0 {
            let corrections = [(); WINDOW].map(|()| rate(0.001 * noise.normal()));
            compensator.revise(&Estimate { corrections, ..Estimate::NONE }).expect("a small one");
        }
        let gyro = rate(0.002 + 0.001 * noise.normal());
        compensator.add(tick, [AngularRate::ZERO, AngularRate::ZERO, gyro], Validity::Good);
        if tick == 200 {
            compensator.end_standstill();
        }
        let delayed = compensator.delayed(Remaining::default(), (100..200).contains(&tick));
        sent += delayed.map_or(0, |delayed| i64::from(delayed.rate.0));
        best += i64::from(gyro.0);
        if let Some(known) = compensator.complete() {
            best -= i64::from(known.correction.0);
            complete += 1;
        }
    }
    assert!(complete > ALL - 20);
    assert_eq!(sent + compensator.pending(Remaining::default()), best);
}

/// The delayed rates are seven samples behind; a second carries at most 100 revisions of 1 deg/s.
#[test]
fn what_a_second_carries_is_known_and_bounded() {
    for (hidden, due) in [(0.01, 0.005), (0.05, 1f64.to_radians())] {
        let mut compensator = Compensator::new(CompensateConfig::DEFAULT);
        for tick in 0..57 {
            compensator.add(tick, [AngularRate::ZERO, AngularRate::ZERO, rate(hidden)], Validity::Good);
            compensator.delayed(Remaining::default(), true);
        }
        assert_eq!(compensator.carried_in_a_second(), 0.0);
        compensator.end_standstill();
        let found = f64::from(compensator.carried_in_a_second());
        assert!((found - due).abs() < 1e-6, "{hidden}: {found}");
    }
}
