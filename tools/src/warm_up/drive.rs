//! This module simulates drives of one device: trips in town, and half an hour on a motorway without a stop.
//!
//! | what | value | source |
//! |---|---|---|
//! | gyro bias by temperature | 0.005 deg/s per kelvin, sigma; over 30 K it bends by 0.03 deg/s, sigma | ICM-42688-P, DS-000347, table 1; the bend is assumed |
//! | gyro bias at power-on | 0.02 deg/s, sigma, beside the device's own 0.25 deg/s | assumed; [`crate::simulate::vehicles`] |
//! | drift on the motorway | 10 K in half an hour, and 0.01 deg/s per hour from another cause | issue of this measurement |
//! | town | stands 12 s in 70; the sensor warms up by 15 K with a time constant of 10 min, from 5 to 25 deg C | assumed |
//! | tyres, each | radius 0.1 % off, and 0.3 % more once warm (10 min) | assumed |
//! | tyres, left and right | differ by 0.03 % once warm, sigma; in curves by 1.7e-4 per m/s^2; in slip by 3 %, sigma, of a driven axle | assumed |
//! | slip | acceleration over 30 g | as [`crate::simulate::vehicles`] |

use crate::drive::DT;
use crate::drive::recording::{Recording, Row};
use crate::drive::vehicle::Vehicle;
use crate::random::Random;
use crate::simulate::mems::{self, Mems};
use crate::simulate::vibration::{self, Vibration};
use gyronet::sample::{ImuSample, RATE_HZ, Validity};
use gyronet::units::{AngularRate, CentiCelsius, Micros, SpecificForce};

const DEG: f64 = std::f64::consts::PI / 180.0;
const GRAVITY: f64 = 9.806_65;
/// Distance between the rear wheels, m.
pub const TRACK: f64 = 1.5;
/// Length of a trip in town, s.
const TOWN_S: f64 = 1_200.0;
/// Time in town before the motorway, s.
pub const MOTORWAY_FROM_S: f64 = 600.0;
const MOTORWAY_S: f64 = 1_800.0;
const PERIOD_S: f64 = 70.0;
const STANDING_S: f64 = 12.0;

/// The errors that all drives of a device share.
#[derive(Debug, Clone, Copy)]
pub struct Device {
    seed: u64,
    /// Bias of each axis at 25 deg C, rad/s, and its changes per kelvin and per square kelvin.
    bias: [[f64; 3]; 3],
}

impl Device {
    /// Creates a device with random errors.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed, 101);
        let mut axis = || [0.25 * DEG, 0.005 * DEG, 0.03 * DEG / 900.0].map(|sigma| sigma * random.normal());
        Self { seed, bias: [axis(), axis(), axis()] }
    }

    fn bias(&self, celsius: f64) -> [f64; 3] {
        let warmer = celsius - 25.0;
        self.bias.map(|[fixed, slope, bend]| fixed + slope * warmer + bend * warmer * warmer)
    }
}

/// The kind of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trip {
    /// Twenty minutes with a stop every 70 s.
    Town,
    /// Ten minutes in town, then half an hour without a stop.
    Motorway,
}

/// A simulated drive with its true yaw rate and bias.
pub struct Drive {
    pub recording: Recording,
    /// True yaw rate and true bias about z at each row, rad/s.
    pub yaw_rate: Vec<f64>,
    pub yaw_bias: Vec<f64>,
}

/// The motion at one time.
struct Motion {
    speed: f64,
    acceleration: f64,
    yaw_rate: f64,
}

/// A Gauss-Markov process of variance 1: its value and its time constant, s.
struct Wander(f64, f64);

impl Wander {
    fn step(&mut self, random: &mut Random) -> f64 {
        let Self(value, seconds) = self;
        *value += -*value * DT / *seconds + (2.0 * DT / *seconds).sqrt() * random.normal();
        *value
    }
}

fn town(seconds: f64, number: usize) -> (f64, f64) {
    let phase = seconds % PERIOD_S;
    let speed = ((phase - STANDING_S) * 1.5).min((PERIOD_S - phase) * 1.8).clamp(0.0, 14.0);
    let bend = (phase - 35.0) / 8.0;
    let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    let turn =
        if (0.0..1.0).contains(&bend) { 0.3 * (std::f64::consts::PI * bend).sin() * side } else { 0.0 };
    (speed, turn)
}

/// Simulates a drive of a device on a day, which seeds the random numbers.
pub fn simulate(device: &Device, trip: Trip, day: u64) -> Drive {
    let seed = device.seed * 1_000 + day;
    let mut random = Random::new(seed, 102);
    // The simulated drift replaces the random walk.
    let part = mems::Config { gyro_bias: 0.0, gyro_walk: 0.0, mount: [0.0; 2], ..mems::Config::DEFAULT };
    let mut mems = Mems::of_device(&part, device.seed, seed);
    let mut vibration = Vibration::new(&vibration::Config::DEFAULT, seed);
    let (cold, drift) = (random.between(5.0, 25.0), 0.01 * DEG / 3600.0 * random.sign());
    let tyres: [f64; 2] = std::array::from_fn(|_| 1.0 + 1e-3 * random.normal());
    let warm = [0.003, 0.003 + 3e-4 * random.normal()];
    let offset = [(); 3].map(|()| 0.02 * DEG * random.normal());
    let slip_difference = 0.03 * random.normal();
    let (mut pace, mut curve) = (Wander(0.0, 60.0), Wander(0.0, 20.0));
    let seconds = if trip == Trip::Town { TOWN_S } else { MOTORWAY_FROM_S + MOTORWAY_S };
    let rows = (seconds * f64::from(RATE_HZ)) as usize;
    let mut drive = Drive {
        recording: Recording {
            path: format!("day {day}"),
            rows: Vec::with_capacity(rows),
            missing: 0,
            vehicle: Vehicle::default(),
        },
        yaw_rate: Vec::with_capacity(rows),
        yaw_bias: Vec::with_capacity(rows),
    };
    let radius = drive.recording.vehicle.radius_m();
    let mut speed_before = 0.0;
    for row in 0..rows {
        let now = row as f64 * DT;
        let on_motorway = (now - MOTORWAY_FROM_S).max(0.0) * f64::from(u8::from(trip == Trip::Motorway));
        let (faster, bend) = (pace.step(&mut random), curve.step(&mut random));
        let (speed, yaw_rate) = if on_motorway > 0.0 {
            let speed = (31.0 + 3.0 * faster).max(20.0).min(0.8 * on_motorway);
            (speed, 3e-4 * bend * speed)
        } else {
            town(now, (now / PERIOD_S) as usize)
        };
        let motion = Motion { speed, acceleration: (speed - speed_before) / DT, yaw_rate };
        speed_before = speed;
        // On the motorway drive the temperature is constant in town.
        let celsius = match trip {
            Trip::Town => cold + 15.0 * (1.0 - (-now / 600.0).exp()),
            Trip::Motorway => cold + 10.0 * on_motorway / MOTORWAY_S,
        };
        let bias = device.bias(celsius);
        let bias: [f64; 3] = std::array::from_fn(|axis| bias[axis] + offset[axis] + drift * on_motorway);
        let shake = vibration.step(motion.speed);
        let [sx, sy, sz] = shake.specific_force;
        let force =
            [motion.acceleration.clamp(-3.0, 3.0) + sx, motion.speed * motion.yaw_rate + sy, GRAVITY + sz];
        let [rx, ry, rz] = shake.angular_rate;
        let (force, rate) = mems.measure(force, [rx, ry, motion.yaw_rate + rz]);
        let rate: [f64; 3] = std::array::from_fn(|axis| rate[axis] + bias[axis]);
        let lateral = motion.speed * motion.yaw_rate;
        let slip = motion.acceleration.clamp(-3.0, 3.0) / (GRAVITY * 30.0);
        let wheel = |side: usize| {
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let ground = motion.speed + sign * motion.yaw_rate * TRACK / 2.0;
            let size = tyres[side] * (1.0 + warm[side] * (1.0 - (-now / 600.0).exp()));
            // The outer wheel is compressed by the load and turns faster.
            let load = 1.0 + sign * 1.7e-4 * lateral / 2.0;
            Some(ground / size * load * (1.0 + slip * (1.0 + sign * slip_difference / 2.0)) / radius)
        };
        let (left, right) = (wheel(0), wheel(1));
        let code = |value: f64| AngularRate::from_rad_per_sec(value as f32).unwrap_or_default();
        let sample = ImuSample {
            time: Micros(row as u64 * 10_000),
            specific_force: force.map(|v| SpecificForce::from_metre_per_sec2(v as f32).unwrap_or_default()),
            angular_rate: rate.map(code),
            temperature: Some(CentiCelsius((100.0 * celsius).round() as i16)),
            validity: Validity::Good,
        };
        drive.recording.rows.push(Row {
            line: row as u64 + 2,
            sample,
            reference: Some(motion.yaw_rate),
            course: None,
            // Front right, rear right, front left, rear left.
            wheels: [right, right, left, left],
        });
        drive.yaw_rate.push(motion.yaw_rate);
        drive.yaw_bias.push(bias[2]);
    }
    drive
}
