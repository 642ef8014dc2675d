//! A model's mounting is taken out where driving shows that it is another unit's, and only there.

use gyronet::compensate::{CompensateConfig, Compensator};
use gyronet::model::window::WINDOW;
use gyronet::model::{Estimate, SteadyGain};
use gyronet::sample::Validity;
use gyronet::units::AngularRate;
use gyronet_host_tests::noise::Noise;

/// The model takes 3 % of the pitch rate off.
const MOUNTING: SteadyGain = SteadyGain([0, 503_316, 0]);

/// A vehicle that turns slowly and shakes fast, with a unit that shows part of the pitch rate as yaw rate.
struct Bench {
    compensator: Compensator,
    noise: Noise,
    tick: u32,
    window: Vec<[AngularRate; 3]>,
    found: u32,
}

impl Bench {
    fn new(seed: u64) -> Self {
        let compensator = Compensator::new(CompensateConfig::DEFAULT);
        Self { compensator, noise: Noise::new(seed), tick: 0, window: Vec::new(), found: 0 }
    }

    /// Runs some seconds; returns the mean square of the corrections of the complete samples, codes squared.
    fn run(&mut self, seconds: u32, coupling: f64, drives: bool) -> f64 {
        let rate = |rad_per_s: f64| AngularRate::from_rad_per_sec(rad_per_s as f32).expect("a rate");
        let mut squares = Vec::new();
        for _ in 0..100 * seconds {
            let turn = 0.3 * (f64::from(self.tick) / 500.0).sin();
            let pitch = 0.03 * self.noise.normal();
            let rates =
                [rate(0.0), rate(pitch), rate(turn + coupling * pitch + 0.0003 * self.noise.normal())];
            self.compensator.add(self.tick, rates, Validity::Good);
            self.found += u32::from(self.compensator.check_mounting(rates, Validity::Good, drives));
            self.window.push(rates);
            if self.tick % 5 == 1 && self.window.len() > WINDOW {
                let end = self.window.len() - 1;
                let corrections = std::array::from_fn(|k| MOUNTING.correction(self.window[end - WINDOW + k]));
                let estimate = Estimate { corrections, steady_gain: MOUNTING, ..Estimate::NONE };
                self.compensator.revise(&estimate).expect("plausible");
            }
            let complete = self.compensator.complete().filter(|complete| complete.good);
            squares.extend(complete.map(|complete| f64::from(complete.correction.0).powi(2)));
            self.tick += 1;
        }
        squares.iter().sum::<f64>() / squares.len() as f64
    }
}

#[test]
fn the_units_own_mounting_stays() {
    for seed in 0..5 {
        let mut bench = Bench::new(seed);
        bench.run(300, 0.03, true);
        assert_eq!(bench.found, 0, "seed {seed}");
    }
}

#[test]
fn another_units_mounting_goes_out_and_comes_back_with_its_unit() {
    for (seed, coupling) in [(0, 0.0), (1, -0.03), (2, -0.01)] {
        let mut bench = Bench::new(seed);
        let before = bench.run(10, coupling, true);
        bench.run(60, coupling, true);
        assert_eq!(bench.found, 1, "seed {seed}");
        let without = bench.run(10, coupling, true);
        assert!(without < 1e-3 * before, "seed {seed}: {without} of {before}");
        // The unit is exchanged for the model's own.
        bench.run(1200, 0.03, true);
        let again = bench.run(10, 0.03, true);
        assert!(again > 0.5 * before, "seed {seed}: {again} of {before}");
        assert_eq!(bench.found, 1, "seed {seed}");
    }
}

/// An engine turns a standing vehicle as fast as it shakes it.
#[test]
fn a_standing_vehicle_shows_nothing() {
    let mut bench = Bench::new(3);
    bench.run(300, -0.5, false);
    assert_eq!(bench.found, 0);
}
