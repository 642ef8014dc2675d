//! Vehicles and their sensors: how they shake, what the part's errors are, what the wheels report.

use gyronet_tools::random::Random;
use std::f64::consts::{PI, TAU};

/// Length of a step of a ride, s.
pub const STEP: f64 = 1e-3;
/// Speed for which the vibration of the road is given, m/s.
const ROAD_SPEED: f64 = 10.0;
/// Width of a vibration's band over its frequency.
const BANDWIDTH: f64 = 0.15;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Xsens,
    /// KVH DSP-1760, beside an MTi.
    Dsp1760,
    Icm42688,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle {
    pub name: &'static str,
    pub part: Part,
    /// Vibration at idle: frequency in Hz, then sigma of each axis in rad/s and m/s^2.
    pub engine: [f64; 3],
    /// Vibrations of the road at `ROAD_SPEED`.
    pub road: [[f64; 3]; 2],
    /// White noise of the gyro, rad/s/sqrt(Hz); of the accelerometer, m/s^2/sqrt(Hz).
    pub noise: [f64; 2],
    /// Sigma of a gyro axis' bias, rad/s, of its change per kelvin, and of its gain.
    pub bias: f64,
    pub per_kelvin: f64,
    pub gain: f64,
    /// Sigma of the mounting's error about each axis, rad.
    pub tilt: f64,
    /// Lowest speed that the wheels show, m/s; `None` without wheels.
    pub wheels: Option<f64>,
}

/// A car with an MTi: the errors of its data sheet, vibration as on the recordings of wid_car.
pub const CAR: Vehicle = Vehicle {
    name: "car",
    part: Part::Xsens,
    engine: [23.4, 0.006, 0.2],
    road: [[1.6, 0.008, 0.2], [14.0, 0.018, 0.4]],
    noise: [1.75e-4, 1.2e-3],
    bias: 3.5e-3,
    per_kelvin: 2e-5,
    gain: 2e-3,
    tilt: 0.02,
    wheels: Some(0.1),
};

/// A hatchback with an ICM-42688-P and passive wheel sensors, which show nothing below 2.75 km/h.
pub const HATCH: Vehicle = Vehicle {
    name: "hatch",
    part: Part::Icm42688,
    engine: [26.0, 0.004, 0.15],
    noise: [5e-5, 7e-4],
    bias: 5e-3,
    per_kelvin: 9e-5,
    gain: 3e-3,
    tilt: 0.03,
    wheels: Some(0.764),
    ..CAR
};

/// A truck with an ICM-42688-P whose diesel shakes the cab at idle, as on the recordings of truck.
pub const TRUCK: Vehicle = Vehicle {
    name: "truck",
    part: Part::Icm42688,
    engine: [9.0, 0.012, 0.35],
    road: [[1.2, 0.02, 0.3], [11.0, 0.02, 0.6]],
    noise: [4e-5, 4e-4],
    bias: 1.5e-3,
    per_kelvin: 2e-5,
    gain: 1.5e-3,
    tilt: 0.02,
    wheels: Some(0.3),
};

/// A utility vehicle, open, hard and without wheel frames, as on the recordings of utv.
pub const UTV: Vehicle = Vehicle {
    name: "utv",
    engine: [18.0, 0.05, 1.2],
    road: [[2.2, 0.06, 0.8], [17.0, 0.10, 1.8]],
    wheels: None,
    ..CAR
};

pub const BARE: Vehicle = Vehicle { name: "bare", wheels: None, ..CAR };

/// The car with a fibre-optic gyro beside its MTi; what happens to the sensor happens to that gyro.
pub const VAN: Vehicle = Vehicle { name: "van", part: Part::Dsp1760, ..CAR };

/// A narrow band of noise: a phasor that turns, decays and is driven by white noise; both parts have variance 1.
#[derive(Debug, Clone, Copy, Default)]
struct Band {
    turn: [f64; 2],
    keep: f64,
    now: [f64; 2],
    /// Sigma of the angle of the turning, rad, and of the force, m/s^2.
    size: [f64; 2],
}

impl Band {
    fn new([hz, rate, force]: [f64; 3], random: &mut Random) -> Self {
        let (sin, cos) = (TAU * hz * STEP).sin_cos();
        let keep = (-PI * BANDWIDTH * hz * STEP).exp();
        let now = [random.normal(), random.normal()];
        Self { turn: [cos, sin], keep, now, size: [rate / (TAU * hz), force] }
    }

    fn step(&mut self, strength: f64, random: &mut Random, [angles, forces]: [&mut [f64; 3]; 2]) {
        let ([cos, sin], [re, im]) = (self.turn, self.now);
        let fresh = (1.0 - self.keep * self.keep).sqrt();
        self.now = [
            self.keep * (re * cos - im * sin) + fresh * random.normal(),
            self.keep * (re * sin + im * cos) + fresh * random.normal(),
        ];
        // Each axis shakes in a phase of its own.
        let [re, im] = self.now;
        let phases = [re, im, 0.6 * re - 0.8 * im];
        for axis in 0..3 {
            angles[axis] += strength * self.size[0] * phases[axis];
            forces[axis] += strength * self.size[1] * phases[2 - axis];
        }
    }
}

/// The vibration of engine and road.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shaking([Band; 3]);

impl Shaking {
    pub fn new(vehicle: &Vehicle, random: &mut Random) -> Self {
        let [low, high] = vehicle.road;
        Self([vehicle.engine, low, high].map(|band| Band::new(band, random)))
    }

    /// Advances by a step; returns the angles, rad, and the forces, m/s^2.
    pub fn step(&mut self, engine: f64, road_speed: f64, random: &mut Random) -> ([f64; 3], [f64; 3]) {
        let (mut angles, mut forces) = ([0.0; 3], [0.0; 3]);
        let road = road_speed / ROAD_SPEED;
        for (band, strength) in self.0.iter_mut().zip([engine, road, road]) {
            band.step(strength, random, [&mut angles, &mut forces]);
        }
        (angles, forces)
    }
}
