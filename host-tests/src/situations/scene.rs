//! A scene: one vehicle, one seed, one situation, from the ride to the judgement.

use super::board::Board;
use super::damage::{Damage, damaged};
use super::judge::{Outcome, judge};
use super::receiver::Receiver;
use super::ride::{Ride, STEP};
use super::sensor::{During, Fault, Sensor};
use super::vehicle::Vehicle;
use super::wheels::{WheelFault, frames};
use gyronet::store::Learned;
use gyronet::units::Micros;
use gyronet_tools::random::Random;

/// Time that a board needs to start, s.
const BOOT: f64 = 0.3;

/// What a situation sets up; it starts as an ordinary vehicle that has not moved yet.
pub struct Scene {
    pub vehicle: Vehicle,
    pub ride: Ride,
    pub sensor: Sensor,
    pub wheels: Vec<During<WheelFault>>,
    /// Period of the yaw messages.
    pub period_ms: u16,
    /// Times at which the board starts again, with what it has learnt.
    pub restarts: Vec<f64>,
    /// What the board's clock shows at the start, s.
    pub epoch: f64,
    /// Damage to the messages of the sensor's line.
    pub damage: Vec<During<Damage>>,
    /// Least share of the seconds that must be good.
    pub least: f64,
    /// Draws what the situation leaves open.
    pub random: Random,
    seed: u64,
}

impl Scene {
    pub fn new(vehicle: &Vehicle, seed: u64) -> Self {
        Self {
            vehicle: *vehicle,
            ride: Ride::default(),
            sensor: Sensor::new(vehicle, &mut Random::new(seed, 1)),
            wheels: Vec::new(),
            period_ms: 10,
            restarts: Vec::new(),
            epoch: 0.0,
            damage: Vec::new(),
            least: 0.7,
            random: Random::new(seed, 0),
            seed,
        }
    }

    /// Rides through so many blocks of a town.
    pub fn town(&mut self, blocks: usize) {
        self.ride.town(blocks, &mut self.random);
    }

    /// The sensor has a fault from the ride's end so far, for this time.
    pub fn sensor_fault(&mut self, seconds: f64, what: Fault) {
        let from = self.ride.end();
        self.sensor.faults.push(During { from, to: from + seconds, what });
    }

    /// The wheels' frames have a fault from the ride's end so far, for this time.
    pub fn wheel_fault(&mut self, seconds: f64, what: WheelFault) {
        let from = self.ride.end();
        self.wheels.push(During { from, to: from + seconds, what });
    }

    /// The sensor's line damages messages from the ride's end so far, for this time.
    pub fn line_fault(&mut self, seconds: f64, what: Damage) {
        let from = self.ride.end();
        self.damage.push(During { from, to: from + seconds, what });
    }

    /// The board starts again now.
    pub fn restart(&mut self) {
        self.restarts.push(self.ride.end());
    }

    /// Rides, and judges what the bus says.
    pub fn run(&self) -> Outcome {
        let random = |stream| Random::new(self.seed, stream);
        let travelled = self.ride.travel(&self.vehicle, &mut random(2));
        let messages = self.sensor.messages(&travelled, &mut random(3));
        let mut messages = damaged(messages, &self.damage, &mut random(5)).into_iter().peekable();
        let shown = self.vehicle.wheels;
        let frames = shown.map(|shown| frames(&travelled, shown, &self.wheels, &mut random(4)));
        let mut frames = frames.unwrap_or_default().into_iter().peekable();
        let start =
            |learned: &Learned| Board::new(self.vehicle.part, shown.is_some(), self.period_ms, learned);
        let (mut board, mut received, mut began) =
            (start(&Learned::NOTHING), Receiver::default(), -self.epoch);
        let mut restarts = self.restarts.iter().peekable();
        let mut outcome = Outcome::default();
        for step in 1..=(travelled.seconds() / STEP) as usize {
            let now = step as f64 * STEP;
            if restarts.next_if(|at| **at <= now).is_some() {
                outcome.add(&judge(&received, &travelled, now));
                (board, received, began) = (start(&board.learned()), Receiver::default(), now + BOOT);
            }
            let clock = Micros(((now - began).max(0.0) * 1e6) as u64);
            while let Some(message) = messages.next_if(|message| message.at <= now + 1e-7) {
                if now >= began {
                    board.receive(&message.bytes, clock);
                }
            }
            while let Some((_, frame)) = frames.next_if(|(at, _)| *at <= now) {
                board.receive_frame(frame);
            }
            if now >= began {
                board.step(clock).iter().for_each(|frame| received.take(frame, now));
            }
        }
        outcome.add(&judge(&received, &travelled, travelled.seconds()));
        outcome.seconds = travelled.seconds() as usize;
        outcome.least = self.least;
        outcome
    }
}
