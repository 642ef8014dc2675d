//! No angle is lost between the network's revised estimates and the rates on the bus: a ledger
//! beside the pipeline, exact to the last code.

use gyronet::compensate::{CompensateConfig, DELAY, SETTLED_AFTER};
use gyronet::health::Status;
use gyronet::model::{Estimate, SCALE_MIN};
use gyronet::pipeline::{Pipeline, PipelineConfig};
use gyronet::sample::ImuSample;
use gyronet::units::AngularRate;
use gyronet::window::WINDOW;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{idling, rate};
use std::collections::BTreeMap;

/// What the sum of the emitted rates must be, from the estimates alone.
#[derive(Default)]
struct Ledger {
    /// Estimates of each sample, and the value that it went out with.
    samples: BTreeMap<u32, (i64, Vec<i64>)>,
    /// Mean of the last believed window.
    prior: i64,
    out: Option<(u32, [i64; WINDOW])>,
    /// Sum of the gyro less its bias.
    gyro: i64,
    rates: i64,
}

impl Ledger {
    /// The best values of all samples as known now, summed.
    fn best(&self) -> i64 {
        self.samples.values().map(best).sum()
    }

    fn break_window(&mut self) {
        self.out = None;
        self.prior = 0;
    }

    fn take_estimate(&mut self, tick: u32, max_mean: i64) {
        let Some((end, estimate)) = self.out.take_if(|(end, _)| tick >= *end + DELAY) else { return };
        let mean = estimate.iter().sum::<i64>() / WINDOW as i64;
        if mean.abs() > max_mean {
            self.prior = 0;
            return;
        }
        for (tick, estimate) in (end + 1 - WINDOW as u32..).zip(estimate) {
            self.samples.get_mut(&tick).expect("windows cover samples that went out").1.push(estimate);
        }
        self.prior = mean;
    }
}

/// The best value of one sample.
fn best((first, estimates): &(i64, Vec<i64>)) -> i64 {
    match estimates.len() as i64 {
        0 => *first,
        n => estimates.iter().sum::<i64>() / n,
    }
}

/// How a stream goes wrong.
#[derive(Clone, Copy)]
struct Faults {
    gaps: bool,
    clipping: bool,
    /// Spread of a window's estimates, and of their mean, rad/s.
    spread: f64,
}

/// 60 s with the ledger checked at every sample; returns how often the carry was bounded
/// and how many samples were settled.
fn check(compensate: CompensateConfig, faults: Faults, seed: u64) -> (u32, u32) {
    let mut noise = Noise::new(seed);
    let mut pipeline = Pipeline::new(PipelineConfig { compensate, ..PipelineConfig::DEFAULT });
    let mut ledger = Ledger::default();
    let (mut tick, mut bounded, mut ready, mut settled) = (0u64, 0, 0, 0);
    let bound = i64::from(compensate.max_carry.0);
    while tick < 6_000 {
        let moving = tick > 400;
        tick += if moving && faults.gaps && noise.int(0, 99) == 0 { noise.int(2, 9) as u64 } else { 1 };
        let clipped = moving && faults.clipping && noise.int(0, 99) == 0;
        let mut sample = ImuSample { clipped, ..idling(tick, 0.003, &mut noise) };
        sample.angular_rate[2].0 += if moving { rate(0.4).0 } else { 0 };
        let broken = ledger.samples.last_key_value().map(|(last, _)| *last);
        let output = pipeline.process(sample).expect("a place on the grid");
        let now = output.yaw_rate;
        let Some([.., bias]) = pipeline.gyro_bias().filter(|_| now.status != Status::Init) else { continue };
        if clipped || broken.is_some_and(|last| now.tick != last + 1) {
            ledger.break_window();
        }
        ledger.take_estimate(now.tick, compensate.max_mean.0.into());
        let gyro = i64::from(sample.angular_rate[2].0 - bias.0);
        ledger.samples.insert(now.tick, (ledger.prior, Vec::new()));
        ledger.gyro += gyro;
        ledger.rates += i64::from(now.rate.0);
        assert_eq!(ledger.rates, ledger.gyro - ledger.best() + pipeline.carry(), "at tick {}", now.tick);
        assert_eq!(now.yaw.0, ledger.rates);
        if let Some(sample) = output.settled {
            let ledger = &ledger.samples[&sample.tick];
            assert_eq!((i64::from(sample.correction.0), ledger.1.is_empty()), (best(ledger), false));
            assert_eq!(now.tick - sample.tick, SETTLED_AFTER);
            settled += 1;
        }
        let carried = gyro - ledger.prior - i64::from(now.rate.0);
        assert!(carried.abs() <= bound, "one frame carries {carried}");
        bounded += u32::from(carried.abs() == bound);
        ready += u32::from(now.status == Status::Ready);
        if let Some(due) = output.window {
            let mean = faults.spread * noise.normal();
            let corrections = [(); WINDOW].map(|()| rate(mean + faults.spread * noise.normal()));
            ledger.out = Some((due.end, corrections.map(|c| c.0.into())));
            pipeline.deliver(due.end, Estimate { corrections, scale: SCALE_MIN, clamped_inputs: 0 });
        }
    }
    assert!(ready > 2_000, "only {ready} samples were corrected");
    (bounded, settled)
}

const CALM: Faults = Faults { gaps: false, clipping: false, spread: 0.0002 };

#[test]
fn clean_stream() {
    let (bounded, settled) = check(CompensateConfig::DEFAULT, CALM, 1);
    assert_eq!(bounded, 0, "nothing here needs the bound");
    assert_eq!(settled, 6_000 - 300 - SETTLED_AFTER, "windows cover every sample after initialisation");
}

#[test]
fn gaps_clipping_and_implausible_windows() {
    for seed in 2..6 {
        check(CompensateConfig::DEFAULT, Faults { gaps: true, clipping: true, spread: 0.03 }, seed);
    }
}

#[test]
fn with_the_bound_active() {
    let tight = CompensateConfig { max_carry: AngularRate(20_000), ..CompensateConfig::DEFAULT };
    assert!(check(tight, CALM, 7).0 > 1_000);
    assert!(check(tight, Faults { gaps: true, clipping: true, spread: 0.02 }, 8).0 > 1_000);
}
