//! Simulates a drive: a car stands, pulls away, follows bends, turns and stops, and a MEMS sensor with
//! known errors measures the motion. The truth is known exactly: the rate of the heading, about the vertical, and the roll
//! and pitch rates of the car's body.
//!
//! [`route`] generates the route, [`car`] moves on a plane with grade, bank and suspension, [`vibration`] shakes the
//! sensor, [`mems`] adds the sensor's own errors and its tilt, and [`csv`] writes the recording. Vibration does not change
//! the car's heading, and counts as an error; so do a tilted sensor and a sloping street.
//!
//! The simulation does not model a particular sensor or car. It shows that everything works, and how well static
//! initialisation performs; only recordings of a real car show whether a network helps.
//!
//! The same seed gives the same bytes on every machine, because the random numbers come from ChaCha8 and the
//! transcendental functions from libm in Rust.

pub mod car;
pub mod csv;
pub mod gnss;
pub mod leg;
pub mod mems;
pub mod purpose;
pub mod route;
pub mod vibration;
pub mod warming;

use crate::drive::DT;
use car::Car;
use gnss::Gnss;
use mems::Mems;
use route::Route;
use vibration::Vibration;
use warming::{Trip, Warming};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    pub seconds: u32,
    /// Seed of the route, the road and the part.
    pub seed: u64,
    pub car: car::Config,
    pub mems: mems::Config,
    /// A trip on which the part warms up; it replaces the part's bias.
    pub warming: Option<warming::Config>,
    pub gnss: Option<gnss::Config>,
}

impl Config {
    /// The default drive lasts 90 s; car, vibration and sensor resemble those of the recordings.
    pub const DEFAULT: Self = Self {
        seconds: 90,
        seed: 1,
        car: car::Config::DEFAULT,
        mems: mems::Config::DEFAULT,
        warming: None,
        gnss: None,
    };
}

/// Holds a sample of a simulated drive: x forward, y left, z up, except for the part's tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time since the start, s.
    pub seconds: f64,
    /// The measured specific force, m/s^2.
    pub specific_force: [f64; 3],
    /// The measured angular rate, rad/s.
    pub angular_rate: [f64; 3],
    /// True roll and pitch rates of the body, and the rate of the heading, about the vertical, rad/s.
    pub reference: [f64; 3],
    /// Rates of the wheels front right, rear right, front left, rear left, rad/s.
    pub wheels: [f64; 4],
    /// Speed, forward positive, m/s.
    pub speed: f64,
    /// Temperature of a part that warms up, deg C.
    pub celsius: Option<f64>,
    /// A course that arrives with the sample.
    pub course: Option<gnss::Course>,
}

#[derive(Debug, Clone)]
pub struct Simulation {
    car: Car,
    vibration: Vibration,
    mems: Mems,
    warming: Option<Warming>,
    gnss: Option<Gnss>,
    tick: u32,
}

impl Simulation {
    pub fn new(config: &Config) -> Self {
        let (seed, warming) = (config.seed, config.warming);
        let route = match warming.map(|warming| warming.trip) {
            Some(Trip::Motorway) => Route::onto_motorway(seed),
            Some(Trip::Town) | None => Route::new(seed),
        };
        Self {
            car: Car::on(&config.car, route, seed),
            vibration: Vibration::new(seed),
            mems: match warming {
                Some(warming) => Mems::of_device(&warming::PART, warming.device, seed),
                None => Mems::new(&config.mems, seed),
            },
            warming: warming.map(|warming| Warming::new(&warming, seed)),
            gnss: config.gnss.map(|gnss| Gnss::new(&gnss, seed)),
            tick: 0,
        }
    }
}

impl Iterator for Simulation {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        let seconds = f64::from(self.tick) * DT;
        self.tick += 1;
        let motion = self.car.step();
        let shake = self.vibration.step(motion.speed);
        let [roll, pitch, _] = motion.angular_rate;
        // The car shakes, whatever the tilt of the part.
        let force = self.mems.tilt(add(motion.specific_force, shake.specific_force));
        let rate = self.mems.tilt(add(motion.angular_rate, shake.angular_rate));
        let (specific_force, mut angular_rate) = self.mems.measure(force, rate);
        let warm = self.warming.as_mut().map(|warming| warming.step(seconds, motion.speed));
        if let Some((_, bias)) = warm {
            angular_rate = add(angular_rate, bias);
        }
        Some(Sample {
            seconds,
            specific_force,
            angular_rate,
            reference: [roll, pitch, motion.heading_rate],
            wheels: self.car.wheels(&motion),
            speed: motion.speed,
            celsius: warm.map(|(celsius, _)| celsius),
            course: self.gnss.as_mut().and_then(|gnss| gnss.step(motion.heading_rate, motion.speed)),
        })
    }
}

pub fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn std(values: &[f64]) -> f64 {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt()
    }

    fn samples(seed: u64, seconds: usize) -> Vec<Sample> {
        Simulation::new(&Config { seed, ..Config::DEFAULT }).take(seconds * 100).collect()
    }

    #[test]
    fn same_seed_same_drive() {
        assert_eq!(samples(7, 30), samples(7, 30));
        assert_ne!(samples(7, 30), samples(8, 30));
    }

    #[test]
    fn shakes_as_the_recordings_do() {
        for seed in 0..5 {
            let samples = samples(seed, 300);
            let still: Vec<&Sample> = samples[..500].iter().collect();
            assert!(still.iter().all(|sample| sample.speed == 0.0));
            let moving: Vec<&Sample> = samples.iter().filter(|sample| sample.speed > 8.0).collect();
            assert!(moving.len() > 5_000);
            for axis in 0..3 {
                let gyro = |set: &[&Sample]| {
                    std(&set.iter().map(|s| s.angular_rate[axis] - s.reference[axis]).collect::<Vec<_>>())
                };
                let accel =
                    |set: &[&Sample]| std(&set.iter().map(|s| s.specific_force[axis]).collect::<Vec<_>>());
                assert!((0.004..0.010).contains(&gyro(&still)), "{axis} {}", gyro(&still));
                assert!((0.05..0.6).contains(&accel(&still)), "{axis} {}", accel(&still));
                assert!((0.008..0.05).contains(&gyro(&moving)), "{axis} {}", gyro(&moving));
                assert!((0.3..1.5).contains(&accel(&moving)), "{axis} {}", accel(&moving));
            }
        }
    }

    #[test]
    fn drives_like_a_car() {
        for seed in 0..20 {
            let samples = samples(seed, 120);
            let rate = |of: fn(f64, f64) -> f64| samples.iter().map(|s| s.reference[2]).fold(0.0, of);
            assert!(rate(f64::max) > 0.12 && rate(f64::min) < -0.12, "turns both ways");
            assert!(rate(f64::max) < 0.4 && rate(f64::min) > -0.4);
            let speed = samples.iter().map(|s| s.speed).fold(0.0, f64::max);
            assert!((10.0..20.0).contains(&speed), "{speed}");
            let stands = samples[1_000..].iter().filter(|s| s.speed == 0.0).count();
            assert!(stands > 200, "stops on the way: {stands}");
            for pair in samples.windows(2) {
                assert!((pair[1].speed - pair[0].speed).abs() < 0.05, "at most 5 m/s^2");
                assert!((pair[1].reference[2] - pair[0].reference[2]).abs() < 0.02);
            }
        }
    }
}
