//! Simulates the vibration of the sensor by the idling engine and by the road.
//!
//! Each source is a narrow band of noise (a damped oscillator driven by white noise) that moves all axes, each with
//! its own amplitude and phase. The source defines the angle; the rate is the change of the angle from sample to
//! sample. The vibration's rate thus sums to zero, as on a car, and its effect on the yaw after one second is about
//! rate / (2 pi f).

use super::DT;
use super::purpose::Purpose;
use crate::random::Random;
use std::f64::consts::{PI, TAU};

#[derive(Debug, Clone, Copy, PartialEq)]
struct Source {
    /// Centre frequency of the band, Hz.
    hz: f64,
    /// Width of the band, Hz.
    bandwidth: f64,
    /// Standard deviation of the angular rate, rad/s.
    angular_rate: [f64; 3],
    /// Standard deviation of the specific force, m/s^2.
    specific_force: [f64; 3],
}

// A small diesel on town roads. The amplitudes are those of the recordings: 0.006 to 0.009 rad/s and 0.1 to 0.45 m/s^2 at
// standstill, about 0.02 rad/s and 0.5 m/s^2 in motion. The bands are the peaks of their spectra.

/// Vibration from the engine, equally strong at standstill and in motion.
const ENGINE: Source = Source {
    hz: 23.4,
    bandwidth: 0.8,
    angular_rate: [0.0062, 0.0075, 0.0055],
    specific_force: [0.40, 0.09, 0.10],
};
/// Vibration from the road at [`ROAD_SPEED`]; it is proportional to the speed.
const ROAD: [Source; 3] = [
    // The body on its springs.
    Source {
        hz: 1.6,
        bandwidth: 0.8,
        angular_rate: [0.010, 0.010, 0.0004],
        specific_force: [0.10, 0.15, 0.25],
    },
    // The wheels on their tyres.
    Source {
        hz: 17.0,
        bandwidth: 3.0,
        angular_rate: [0.020, 0.022, 0.011],
        specific_force: [0.20, 0.20, 0.20],
    },
    // Floor panels.
    Source {
        hz: 30.0,
        bandwidth: 4.0,
        angular_rate: [0.008, 0.008, 0.008],
        specific_force: [0.25, 0.20, 0.35],
    },
];
/// Speed for which [`ROAD`] is given, m/s.
const ROAD_SPEED: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shake {
    /// Specific force of the vibration, m/s^2.
    pub specific_force: [f64; 3],
    /// Angular rate of the vibration, rad/s.
    pub angular_rate: [f64; 3],
}

/// Simulates a narrow band of noise: a phasor that rotates, decays, and is driven by white noise. Both of its parts
/// have variance 1.
#[derive(Debug, Clone, Copy)]
struct Band {
    re: f64,
    im: f64,
}

impl Band {
    fn step(&mut self, source: &Source, random: &mut Random) {
        let keep = libm::exp(-PI * source.bandwidth * DT);
        let (sin, cos) = (libm::sin(TAU * source.hz * DT), libm::cos(TAU * source.hz * DT));
        let fresh = (1.0 - keep * keep).sqrt();
        let (re, im) = (self.re * cos - self.im * sin, self.re * sin + self.im * cos);
        self.re = keep * re + fresh * random.normal();
        self.im = keep * im + fresh * random.normal();
    }

    /// Returns the band's value for each axis, with a different phase for each.
    fn axes(&self, phase: f64) -> [f64; 3] {
        [phase, phase + 2.0, phase + 4.2].map(|p| self.re * libm::cos(p) + self.im * libm::sin(p))
    }
}

#[derive(Debug, Clone, Copy)]
struct Shaker {
    source: Source,
    band: Band,
    angle: [f64; 3],
}

impl Shaker {
    fn new(source: Source, random: &mut Random) -> Self {
        Self { source, band: Band { re: random.normal(), im: random.normal() }, angle: [0.0; 3] }
    }

    fn step(&mut self, strength: f64, random: &mut Random, shake: &mut Shake) {
        self.band.step(&self.source, random);
        // Ratio of the angle's amplitude to the rate's, for a sine sampled on the grid.
        let angle_per_rate = DT / (2.0 * libm::sin(PI * self.source.hz * DT));
        let (turn, push) = (self.band.axes(0.0), self.band.axes(1.0));
        for axis in 0..3 {
            let angle = strength * self.source.angular_rate[axis] * angle_per_rate * turn[axis];
            shake.angular_rate[axis] += (angle - self.angle[axis]) / DT;
            shake.specific_force[axis] += strength * self.source.specific_force[axis] * push[axis];
            self.angle[axis] = angle;
        }
    }
}

#[derive(Debug, Clone)]
pub struct Vibration {
    random: Random,
    engine: Shaker,
    road: [Shaker; 3],
}

impl Vibration {
    /// Starts with the engine running.
    pub fn new(seed: u64) -> Self {
        let mut random = Purpose::Vibration.stream(seed);
        let engine = Shaker::new(ENGINE, &mut random);
        let road = ROAD.map(|source| Shaker::new(source, &mut random));
        let mut vibration = Self { random, engine, road };
        // The first angle has no predecessor to compute a rate from, so discard the first step.
        vibration.step(0.0);
        vibration
    }

    /// Advances by 10 ms at a speed in m/s.
    pub fn step(&mut self, speed: f64) -> Shake {
        let mut shake = Shake::default();
        self.engine.step(1.0, &mut self.random, &mut shake);
        for shaker in &mut self.road {
            shaker.step(speed / ROAD_SPEED, &mut self.random, &mut shake);
        }
        shake
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaking_turns_the_car_nowhere() {
        let mut vibration = Vibration::new(1);
        let mut yaw = 0.0f64;
        for _ in 0..100_000 {
            let [.., rate] = vibration.step(10.0).angular_rate;
            yaw += rate * DT;
            assert!(yaw.abs() < 0.002, "{yaw}");
        }
    }

    #[test]
    fn sizes_are_as_configured() {
        let mut vibration = Vibration::new(2);
        let shakes: Vec<Shake> = (0..200_000).map(|_| vibration.step(0.0)).collect();
        let rms = |of: fn(&Shake) -> f64| {
            (shakes.iter().map(|s| of(s) * of(s)).sum::<f64>() / shakes.len() as f64).sqrt()
        };
        assert!((rms(|s| s.angular_rate[2]) / ENGINE.angular_rate[2] - 1.0).abs() < 0.05);
        assert!((rms(|s| s.specific_force[0]) / ENGINE.specific_force[0] - 1.0).abs() < 0.05);
    }
}
