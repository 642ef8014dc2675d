//! Rides: what a vehicle does, and from it the exact heading, rates and forces every millisecond.
//!
//! Axes are x forward, y left, z up. Heading, pitch (nose down positive) and roll (left side up positive) turn in that
//! order (Rajamani, Vehicle Dynamics and Control, chapter 2). Rates and forces are kept as integrals, so that the mean
//! between any two times is exact.

use super::vehicle::{STEP, Shaking, Vehicle};
use gyronet_tools::random::Random;
use std::f64::consts::TAU;

const GRAVITY: f64 = 9.80665;
/// Share of a turn in which the steering moves in, and again out.
const STEERING: f64 = 0.3;
/// Natural frequency (rad/s), damping, roll (rad per m/s^2) and pitch of a body on its springs: Rajamani, and 4 and 2
/// deg/g of a passenger car.
const SPRINGS: [f64; 4] = [8.2, 0.35, 0.0071, 0.0036];
/// Periods of a swell in roll and pitch, s.
const SWELL: [f64; 2] = [9.0, 6.5];

/// A stretch of a ride. Whatever differs from the stretch before changes smoothly.
#[derive(Debug, Clone, Copy)]
pub struct Leg {
    pub seconds: f64,
    /// Speed over ground at the end, backwards negative, m/s.
    pub speed: f64,
    /// Angle turned on the ground or on a deck, left positive, rad.
    pub turn: f64,
    /// Rate of the deck, turntable or carrier at the end, rad/s.
    pub carried: f64,
    /// Slope at the end, uphill positive, and bank, left side up, rad.
    pub slope: f64,
    pub bank: f64,
    /// Amplitude of the deck's roll and pitch, rad.
    pub swell: f64,
    /// Vibration of the engine and of the road over the vehicle's own.
    pub engine: f64,
    pub road: f64,
    /// Speed of the wheels over that over ground: 0 where it is carried, towed on a trailer, or slides.
    pub rolling: f64,
    /// Share of a turn that its path follows: 0 in a spin.
    pub grip: f64,
}

/// A ride in the making: [`Ride::now`] is what the next leg continues with.
#[derive(Debug, Clone)]
pub struct Ride {
    pub now: Leg,
    legs: Vec<Leg>,
}

impl Default for Ride {
    fn default() -> Self {
        let now = Leg {
            seconds: 0.0,
            speed: 0.0,
            turn: 0.0,
            carried: 0.0,
            slope: 0.0,
            bank: 0.0,
            swell: 0.0,
            engine: 1.0,
            road: 1.0,
            rolling: 1.0,
            grip: 1.0,
        };
        Self { now, legs: Vec::new() }
    }
}

impl Ride {
    pub fn hold(&mut self, seconds: f64) -> &mut Self {
        self.turn(0.0, seconds)
    }

    /// Turns left by this angle.
    pub fn turn(&mut self, degrees: f64, seconds: f64) -> &mut Self {
        self.legs.push(Leg { seconds, turn: degrees.to_radians(), ..self.now });
        self
    }

    pub fn reach(&mut self, speed: f64, seconds: f64) -> &mut Self {
        self.now.speed = speed;
        self.hold(seconds)
    }

    pub fn stop(&mut self, seconds: f64, rest: f64) -> &mut Self {
        self.reach(0.0, seconds).hold(rest)
    }

    /// Blocks of a town: each with an acceleration, two turns, and a stop.
    pub fn town(&mut self, blocks: usize, random: &mut Random) -> &mut Self {
        for _ in 0..blocks {
            let speed = random.between(8.0, 13.0);
            let slow = random.between(4.0, 7.0);
            self.reach(speed, speed / 2.0).hold(random.between(1.0, 3.0)).reach(slow, 3.0);
            self.turn(random.sign() * random.between(70.0, 100.0), random.between(4.0, 6.0));
            self.reach(speed, 3.0).turn(random.sign() * random.between(5.0, 30.0), 4.0);
            self.stop(speed / 2.0, random.between(4.0, 8.0));
        }
        self
    }

    /// The end of the ride so far, s.
    pub fn end(&self) -> f64 {
        self.legs.iter().map(|leg| leg.seconds).sum()
    }

    pub fn travel(&self, vehicle: &Vehicle, random: &mut Random) -> Travelled {
        let mut body = Body { shaking: Shaking::new(vehicle, random), ..Body::default() };
        let mut travelled = Travelled::default();
        travelled.push(&body, 1.0);
        let mut before = *self.legs.first().unwrap_or(&self.now);
        for leg in &self.legs {
            let steps = (leg.seconds / STEP).round() as usize;
            for step in 1..=steps {
                let at = [step as f64 - 0.5, step as f64].map(|step| step / steps as f64);
                body.step(leg, at.map(|at| between(&before, leg, at)), at[0], random);
                travelled.push(&body, leg.rolling);
            }
            before = *leg;
        }
        travelled
    }
}

/// The values that change smoothly, at a place in a leg.
fn between(from: &Leg, to: &Leg, at: f64) -> Leg {
    let smooth = at * at * (3.0 - 2.0 * at);
    let mix = |from: f64, to: f64| from + (to - from) * smooth;
    Leg {
        speed: mix(from.speed, to.speed),
        carried: mix(from.carried, to.carried),
        slope: mix(from.slope, to.slope),
        bank: mix(from.bank, to.bank),
        swell: mix(from.swell, to.swell),
        engine: mix(from.engine, to.engine),
        road: mix(from.road, to.road),
        ..*to
    }
}

/// The rate of a turn over its mean: the steering moves in, holds, and moves out.
fn steered(at: f64) -> f64 {
    let edge = (at.min(1.0 - at) / STEERING).min(1.0);
    (0.5 - 0.5 * (TAU * edge / 2.0).cos()) / (1.0 - STEERING)
}

/// The vehicle's body at one time; angles in rad, integrals since the start.
#[derive(Debug, Clone, Default)]
struct Body {
    time: f64,
    speed: f64,
    heading: f64,
    /// Pitch and roll, and those of the body on its springs with their rates.
    attitude: [f64; 2],
    sprung: [[f64; 2]; 2],
    turned: [f64; 3],
    pushed: [f64; 3],
    shaking: Shaking,
    shaken: [f64; 3],
}

impl Body {
    fn step(&mut self, leg: &Leg, [middle, end]: [Leg; 2], at: f64, random: &mut Random) {
        self.time += STEP;
        let yaw_rate = leg.turn / leg.seconds * steered(at) + middle.carried;
        let acceleration = [(end.speed - self.speed) / STEP, leg.grip * middle.speed * yaw_rate];
        self.speed = end.speed;
        let [frequency, damping, roll, pitch] = SPRINGS;
        for ([angle, rate], pull) in
            self.sprung.iter_mut().zip([-pitch * acceleration[0], roll * acceleration[1]])
        {
            *rate += (frequency * frequency * (pull - *angle) - 2.0 * damping * frequency * *rate) * STEP;
            *angle += *rate * STEP;
        }
        let swell = SWELL.map(|period| end.swell * (TAU * self.time / period).sin());
        let attitude = [self.sprung[0][0] + swell[1] - end.slope, self.sprung[1][0] + swell[0] + end.bank];
        let [pitch_rate, roll_rate] = [0, 1].map(|axis| (attitude[axis] - self.attitude[axis]) / STEP);
        let [pitch, roll] = [0, 1].map(|axis| (attitude[axis] + self.attitude[axis]) / 2.0);
        self.attitude = attitude;
        let ((sin_pitch, cos_pitch), (sin_roll, cos_roll)) = (pitch.sin_cos(), roll.sin_cos());
        let rates = [
            roll_rate - yaw_rate * sin_pitch,
            pitch_rate * cos_roll + yaw_rate * sin_roll * cos_pitch,
            yaw_rate * cos_roll * cos_pitch - pitch_rate * sin_roll,
        ];
        let [ahead, left] = acceleration;
        let up = GRAVITY * cos_pitch + ahead * sin_pitch;
        let forces = [
            ahead * cos_pitch - GRAVITY * sin_pitch,
            left * cos_roll + up * sin_roll,
            up * cos_roll - left * sin_roll,
        ];
        let (shaken, pushed) = self.shaking.step(middle.engine, middle.road * middle.speed.abs(), random);
        for axis in 0..3 {
            self.turned[axis] += rates[axis] * STEP + shaken[axis] - self.shaken[axis];
            self.pushed[axis] += (forces[axis] + pushed[axis]) * STEP;
        }
        // The shaking turns the vehicle too, and back.
        self.heading += yaw_rate * STEP + shaken[2] - self.shaken[2];
        self.shaken = shaken;
    }
}

/// A ride's truth, every [`STEP`].
#[derive(Debug, Clone, Default)]
pub struct Travelled {
    heading: Vec<f64>,
    speed: Vec<f64>,
    rolling: Vec<f64>,
    integrals: Vec<[f64; 6]>,
}

impl Travelled {
    fn push(&mut self, body: &Body, rolling: f64) {
        self.heading.push(body.heading);
        self.speed.push(body.speed);
        self.rolling.push(rolling);
        let ([a, b, c], [d, e, f]) = (body.turned, body.pushed);
        self.integrals.push([a, b, c, d, e, f]);
    }

    /// The truth of a recording: its headings at times from 0 on. Where one is missing for long it is not a number.
    pub fn recorded(points: &[(f64, f64)], longest: f64) -> Self {
        let mut travelled = Self::default();
        for pair in points.windows(2) {
            let [(from, heading), (to, next)] = [pair[0], pair[1]];
            let change = if to - from > longest { f64::NAN } else { (next - heading) / (to - from) };
            while travelled.heading.len() as f64 * STEP < to {
                let since = travelled.heading.len() as f64 * STEP - from;
                travelled.heading.push(if since < 0.0 { f64::NAN } else { heading + change * since });
            }
        }
        travelled.speed = vec![f64::NAN; travelled.heading.len()];
        travelled
    }

    pub fn seconds(&self) -> f64 {
        (self.heading.len() - 1) as f64 * STEP
    }

    /// Index of the step before a time, and the share of the next one.
    fn place(&self, time: f64) -> (usize, f64) {
        let at = (time / STEP).clamp(0.0, (self.heading.len() - 2) as f64);
        (at as usize, at.fract())
    }

    pub fn heading(&self, time: f64) -> f64 {
        let (at, share) = self.place(time);
        self.heading[at] + share * (self.heading[at + 1] - self.heading[at])
    }

    /// The true rate of the heading over 20 ms, rad/s.
    pub fn rate(&self, time: f64) -> f64 {
        (self.heading(time + 0.01) - self.heading(time - 0.01)) / 0.02
    }

    /// Speed over ground, m/s.
    pub fn speed(&self, time: f64) -> f64 {
        self.speed[self.place(time).0]
    }

    /// Speed that the wheels show, m/s.
    pub fn rolled(&self, time: f64) -> f64 {
        let at = self.place(time).0;
        self.speed[at] * self.rolling[at]
    }

    /// Mean rates (rad/s) and specific forces (m/s^2) of the body between two times.
    pub fn mean(&self, from: f64, to: f64) -> [f64; 6] {
        let at = |time: f64, axis: usize| {
            let (at, share) = self.place(time);
            self.integrals[at][axis] + share * (self.integrals[at + 1][axis] - self.integrals[at][axis])
        };
        std::array::from_fn(|axis| (at(to, axis) - at(from, axis)) / (to - from))
    }
}
