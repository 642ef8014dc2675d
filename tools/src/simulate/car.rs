//! Simulates the motion of the car on a plane, with road grade and bank and a body on springs.
//!
//! Axes are x forward, y left, z up; rotations are heading, pitch and roll in that order. The sensor is at the
//! centre, without a lever arm. The formulas are in any text on vehicle dynamics, for example Rajamani, Vehicle
//! Dynamics and Control, chapter 2.

use super::DT;
use super::leg::Leg;
use super::purpose::Purpose;
use super::route::Route;
use crate::random::Random;
use std::f64::consts::TAU;

/// Standard gravity, m/s^2.
pub const GRAVITY: f64 = 9.80665;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Wheel radius, m: that of the recordings' car.
    pub wheel_radius: f64,
    /// Distance between left and right wheels, m: a common passenger car.
    pub track: f64,
    /// Noise of a wheel's rate, rad/s: standing wheels of the recordings show 0.005 to 0.02.
    pub wheel_noise: f64,
    /// Acceleration when pulling away, m/s^2: a calm driver.
    pub acceleration: f64,
    /// Deceleration when braking, m/s^2: a calm driver.
    pub braking: f64,
    /// Time constant of a pedal's effect, s.
    pub pedal_lag: f64,
    /// Roll to the outside, rad per m/s^2: 4 deg/g, a common passenger car.
    pub roll_gradient: f64,
    /// Dive and squat, rad per m/s^2: 2 deg/g.
    pub pitch_gradient: f64,
    /// Natural frequency of the body on its springs, Hz.
    pub suspension_hz: f64,
    /// Damping ratio of the body on its springs.
    pub suspension_damping: f64,
    /// Amplitude of the road's grade, rad: a town on nearly level ground.
    pub road_grade: f64,
    /// Amplitude of the road's bank, rad: the same.
    pub road_bank: f64,
    /// Wavelengths of the bank, m. If grade and bank share one, pitch and roll stay in phase for hours, and their
    /// product makes a gyro drift by several deg/h, unlike a real road.
    pub bank_waves: [f64; 2],
}

impl Config {
    pub const DEFAULT: Self = Self {
        wheel_radius: 0.289,
        track: 1.5,
        wheel_noise: 0.01,
        acceleration: 2.0,
        braking: 1.8,
        pedal_lag: 0.3,
        roll_gradient: 0.0071,
        pitch_gradient: 0.0036,
        suspension_hz: 1.3,
        suspension_damping: 0.35,
        road_grade: 0.008,
        road_bank: 0.008,
        // In 90 s and with these amplitudes, the drift from the shared wavelengths is far below the gyro's bias.
        bank_waves: GRADE_WAVES,
    };
}

/// Holds the readings of a perfect, level part at the car's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Specific force, m/s^2.
    pub specific_force: [f64; 3],
    /// Angular rate, rad/s.
    pub angular_rate: [f64; 3],
    /// Speed, forward positive, m/s.
    pub speed: f64,
    /// Rate of the heading, about the vertical, rad/s.
    pub heading_rate: f64,
    /// Acceleration along the road, m/s^2.
    pub acceleration: f64,
    /// Slope of the road along the way, downhill positive, rad.
    pub grade: f64,
    /// The pitch of the body, nose down positive, rad.
    pub pitch: f64,
    /// The roll of the body, left side up positive, rad.
    pub roll: f64,
}

/// Simulates an angle on a damped spring, which follows its target and oscillates.
#[derive(Debug, Clone, Copy, Default)]
struct Spring {
    angle: f64,
    rate: f64,
}

impl Spring {
    fn step(&mut self, config: &Config, pulled_to: f64) {
        let omega = TAU * config.suspension_hz;
        let damping = 2.0 * config.suspension_damping * omega * self.rate;
        self.rate += (omega * omega * (pulled_to - self.angle) - damping) * DT;
        self.angle += self.rate * DT;
    }
}

/// A slope of the road as a function of the distance: the sum of two waves.
#[derive(Debug, Clone, Copy)]
struct Slope {
    amplitude: f64,
    waves: [f64; 2],
    phase: [f64; 2],
}

/// Wavelengths of the grade, m.
const GRADE_WAVES: [f64; 2] = [310.0, 97.0];

impl Slope {
    fn new(amplitude: f64, waves: [f64; 2], random: &mut Random) -> Self {
        Self { amplitude, waves, phase: [random.between(0.0, TAU), random.between(0.0, TAU)] }
    }

    /// Returns the angle at a distance and its change per metre.
    fn at(&self, metres: f64) -> (f64, f64) {
        let (mut angle, mut change) = (0.0, 0.0);
        for (wave, phase) in self.waves.into_iter().zip(self.phase) {
            let argument = TAU * metres / wave + phase;
            angle += 0.5 * self.amplitude * libm::sin(argument);
            change += 0.5 * self.amplitude * libm::cos(argument) * TAU / wave;
        }
        (angle, change)
    }
}

#[derive(Debug, Clone)]
pub struct Car<W = Route> {
    config: Config,
    way: W,
    leg: Leg,
    next: Leg,
    /// Position in the leg: metres on a road, seconds of a wait.
    along: f64,
    travelled: f64,
    speed: f64,
    acceleration: f64,
    roll: Spring,
    pitch: Spring,
    bank: Slope,
    grade: Slope,
    wheel_noise: Random,
}

impl Car {
    /// Starts at rest on the short course of [`Route`].
    pub fn new(config: &Config, seed: u64) -> Self {
        Self::on(config, Route::new(seed), seed)
    }
}

impl<W: Iterator<Item = Leg>> Car<W> {
    /// Starts at rest on a route, and waits at its end.
    pub fn on(config: &Config, mut way: W, seed: u64) -> Self {
        let mut road = Purpose::Road.stream(seed);
        let (first, second) = (next_leg(&mut way), next_leg(&mut way));
        Self {
            config: *config,
            way,
            leg: first,
            next: second,
            along: 0.0,
            travelled: 0.0,
            speed: 0.0,
            acceleration: 0.0,
            roll: Spring::default(),
            pitch: Spring::default(),
            bank: Slope::new(config.road_bank, config.bank_waves, &mut road),
            grade: Slope::new(config.road_grade, GRADE_WAVES, &mut road),
            wheel_noise: Purpose::Wheels.stream(seed),
        }
    }

    /// Advances by 10 ms.
    pub fn step(&mut self) -> Motion {
        self.drive();
        let heading_rate = self.speed * self.leg.curvature(self.along);
        let lateral = self.speed * heading_rate;
        self.roll.step(&self.config, self.config.roll_gradient * lateral);
        self.pitch.step(&self.config, -self.config.pitch_gradient * self.acceleration);
        let (bank, bank_change) = self.bank.at(self.travelled);
        let (grade, grade_change) = self.grade.at(self.travelled);
        let (roll, roll_rate) = (bank + self.roll.angle, bank_change * self.speed + self.roll.rate);
        let (pitch, pitch_rate) = (grade + self.pitch.angle, grade_change * self.speed + self.pitch.rate);
        let (speed, acceleration) = (self.speed, self.acceleration);
        let level = [self.acceleration, lateral, GRAVITY];
        Motion {
            specific_force: turned_in(level, pitch, roll),
            angular_rate: body_rates(heading_rate, (pitch, pitch_rate), (roll, roll_rate)),
            speed,
            heading_rate,
            acceleration,
            grade,
            pitch,
            roll,
        }
    }

    /// Returns the rates of the wheels front right, rear right, front left, rear left, rad/s.
    pub fn wheels(&mut self, motion: &Motion) -> [f64; 4] {
        let half = motion.heading_rate * self.config.track / 2.0;
        [half, half, -half, -half].map(|outer| {
            (motion.speed + outer) / self.config.wheel_radius
                + self.config.wheel_noise * self.wheel_noise.normal()
        })
    }

    fn drive(&mut self) {
        let command = match self.leg {
            Leg::Stand { seconds } => {
                if self.speed == 0.0 {
                    self.along += DT;
                    if self.along > seconds {
                        self.turn_to_next_leg();
                    }
                }
                -self.config.braking
            }
            Leg::Road { metres, speed, .. } => {
                let left = (metres - self.along).max(0.0);
                let brake_in_time = (self.next.speed().powi(2) + 2.0 * self.config.braking * left).sqrt();
                // The car never stops before the end of a leg, so that every leg ends.
                let wanted = speed.min(brake_in_time).max(0.5);
                // A calm driver corrects a speed difference in 0.8 s.
                ((wanted - self.speed) / 0.8).clamp(-1.5 * self.config.braking, self.config.acceleration)
            }
        };
        self.acceleration += (command - self.acceleration) * DT / self.config.pedal_lag;
        let before = self.speed;
        self.speed = (self.speed + self.acceleration * DT).max(0.0);
        self.acceleration = (self.speed - before) / DT;
        self.travelled += self.speed * DT;
        if let Leg::Road { metres, .. } = self.leg {
            self.along += self.speed * DT;
            if self.along >= metres {
                self.turn_to_next_leg();
            }
        }
    }

    fn turn_to_next_leg(&mut self) {
        self.leg = self.next;
        self.next = next_leg(&mut self.way);
        self.along = 0.0;
    }
}

/// The next leg of a route; after the last one, an endless wait.
fn next_leg(way: &mut impl Iterator<Item = Leg>) -> Leg {
    way.next().unwrap_or(Leg::Stand { seconds: f64::INFINITY })
}

/// Converts a vector from the level frame to the axes of a body that is pitched, then rolled.
pub fn turned_in([x, y, z]: [f64; 3], pitch: f64, roll: f64) -> [f64; 3] {
    let (sp, cp, sr, cr) = (libm::sin(pitch), libm::cos(pitch), libm::sin(roll), libm::cos(roll));
    let (x, z) = (x * cp - z * sp, x * sp + z * cp);
    [x, y * cr + z * sr, -y * sr + z * cr]
}

fn body_rates(heading: f64, (pitch, pitch_rate): (f64, f64), (roll, roll_rate): (f64, f64)) -> [f64; 3] {
    let (sp, cp, sr, cr) = (libm::sin(pitch), libm::cos(pitch), libm::sin(roll), libm::cos(roll));
    [roll_rate - heading * sp, pitch_rate * cr + heading * cp * sr, -pitch_rate * sr + heading * cp * cr]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_shows_the_tilt() {
        let [x, _, z] = turned_in([0.0, 0.0, GRAVITY], 0.1, 0.0);
        assert!((x + GRAVITY * libm::sin(0.1)).abs() < 1e-12, "nose down: {x}");
        assert!((z - GRAVITY * libm::cos(0.1)).abs() < 1e-12);
        let [_, y, _] = turned_in([0.0, 0.0, GRAVITY], 0.0, 0.1);
        assert!((y - GRAVITY * libm::sin(0.1)).abs() < 1e-12, "left side up: {y}");
    }

    #[test]
    fn a_leg_turns_by_what_it_says() {
        let leg = Leg::Road { metres: 30.0, speed: 6.0, turn: 1.2 };
        let turned: f64 = (0..3_000).map(|k| leg.curvature(0.01 * f64::from(k)) * 0.01).sum();
        assert!((turned - 1.2).abs() < 1e-9, "{turned}");
    }

    #[test]
    fn the_body_leans_out_of_a_turn_and_wheels_turn_unevenly() {
        let mut car =
            Car::new(&Config { road_grade: 0.0, road_bank: 0.0, wheel_noise: 0.0, ..Config::DEFAULT }, 3);
        let steepest = (0..12_000)
            .map(|_| {
                let motion = car.step();
                (motion, car.wheels(&motion), car.roll.angle)
            })
            .max_by(|a, b| a.0.heading_rate.total_cmp(&b.0.heading_rate))
            .unwrap();
        let (motion, [right, _, left, _], roll) = steepest;
        assert!(motion.heading_rate > 0.12 && roll > 0.0);
        assert!(motion.specific_force[1] > motion.speed * motion.heading_rate, "gravity adds to it");
        let from_wheels = (right - left) * 0.289 / 1.5;
        assert!((from_wheels - motion.heading_rate).abs() < 1e-12);
    }
}
