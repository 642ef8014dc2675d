//! A scene: one vehicle, one seed, one situation, from the ride to the judgement.

use super::board::Board;
use super::damage::{Damage, damaged};
use super::judge::{EXACT, Outcome, judge};
use super::receiver::{FIBRE_OPTIC, INERTIAL, Receiver};
use super::ride::Ride;
use super::sensor::{During, Fault, Message, Sensor};
use super::vehicle::{Part, STEP, Vehicle};
use super::wheels::{WheelFault, frames};
use gyronet::store::Learned;
use gyronet::units::Micros;
use gyronet_tools::random::Random;

/// Time that a board needs to start, s.
const BOOT: f64 = 0.3;

/// The setting of a situation; it starts as an ordinary vehicle that has not moved yet.
pub struct Scene {
    pub vehicle: Vehicle,
    pub ride: Ride,
    pub sensor: Sensor,
    /// A gyro beside the sensor, which then has the sensor's faults instead.
    pub fibre_optic: Option<Sensor>,
    pub wheels: Vec<During<WheelFault>>,
    pub period_ms: u16,
    /// Times at which the board starts again, with what it has learnt.
    pub restarts: Vec<f64>,
    /// The reading of the board's clock at the start, s.
    pub epoch: f64,
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
            fibre_optic: (vehicle.part == Part::Dsp1760)
                .then(|| Sensor::fibre_optic(&mut Random::new(seed, 6))),
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

    /// Stands for eight seconds, and rides through so many blocks of a town.
    pub fn start(&mut self, blocks: usize) {
        self.ride.hold(8.0);
        self.town(blocks);
    }

    pub fn town(&mut self, blocks: usize) {
        self.ride.town(blocks, &mut self.random);
    }

    /// The sensor that the situation is about: a fibre-optic gyro if there is one.
    pub fn measures(&mut self) -> &mut Sensor {
        self.fibre_optic.as_mut().unwrap_or(&mut self.sensor)
    }

    /// Something that begins at the ride's end so far.
    fn lasting<T>(&self, seconds: f64, what: T) -> During<T> {
        let from = self.ride.end();
        During { from, to: from + seconds, what }
    }

    pub fn sensor_fault(&mut self, seconds: f64, what: Fault) {
        let fault = self.lasting(seconds, what);
        self.measures().faults.push(fault);
    }

    pub fn wheel_fault(&mut self, seconds: f64, what: WheelFault) {
        self.wheels.push(self.lasting(seconds, what));
    }

    pub fn line_fault(&mut self, seconds: f64, what: Damage) {
        self.damage.push(self.lasting(seconds, what));
    }

    pub fn restart(&mut self) {
        self.restarts.push(self.ride.end());
    }

    pub fn run(&self) -> Outcome {
        let random = |stream| Random::new(self.seed, stream);
        let travelled = self.ride.travel(&self.vehicle, &mut random(2));
        let inertial = self.sensor.messages(&travelled, &mut random(3));
        let fibre_optic = self.fibre_optic.iter().flat_map(|gyro| gyro.messages(&travelled, &mut random(7)));
        let fibre_optic: Vec<Message> = fibre_optic.collect();
        let damage = |messages, is_meant: bool| {
            let damage = if is_meant { &self.damage[..] } else { &[] };
            damaged(messages, damage, &mut random(5)).into_iter().peekable()
        };
        let mut inertial = damage(inertial, self.fibre_optic.is_none());
        let mut fibre_optic = damage(fibre_optic, true);
        let shown = self.vehicle.wheels;
        let frames = shown.map(|shown| frames(&travelled, shown, &self.wheels, &mut random(4)));
        let mut frames = frames.unwrap_or_default().into_iter().peekable();
        let start =
            |learned: &Learned| Board::new(self.vehicle.part, shown.is_some(), self.period_ms, learned);
        let receivers = || {
            let firsts = if self.fibre_optic.is_some() { &[INERTIAL, FIBRE_OPTIC][..] } else { &[INERTIAL] };
            firsts.iter().map(|first| Receiver::new(*first)).collect::<Vec<_>>()
        };
        let (mut board, mut received, mut began) = (start(&Learned::NOTHING), receivers(), -self.epoch);
        let mut restarts = self.restarts.iter().peekable();
        let mut outcome = Outcome { least: self.least, ..Outcome::default() };
        let finish = |outcome: &mut Outcome, received: &[Receiver], now: f64| {
            received.iter().for_each(|received| outcome.add(&judge(received, &travelled, now, &EXACT)));
        };
        for step in 1..=(travelled.seconds() / STEP) as usize {
            let now = step as f64 * STEP;
            if restarts.next_if(|at| **at <= now).is_some() {
                finish(&mut outcome, &received, now);
                (board, received, began) = (start(&board.learned()), receivers(), now + BOOT);
            }
            let runs = now >= began;
            let clock = Micros(((now - began).max(0.0) * 1e6).round() as u64);
            let arrives = |message: &Message| message.at <= now + 1e-7;
            while let Some(message) = inertial.next_if(arrives) {
                if runs {
                    board.receive(&message.bytes);
                }
            }
            while let Some(message) = fibre_optic.next_if(arrives) {
                if runs {
                    board.receive_fibre_optic(&message.bytes, clock);
                }
            }
            while let Some((_, frame)) = frames.next_if(|(at, _)| *at <= now) {
                board.receive_frame(frame);
            }
            if runs {
                for frame in board.step(clock) {
                    received.iter_mut().for_each(|receiver| receiver.take(&frame, now));
                }
            }
        }
        finish(&mut outcome, &received, travelled.seconds());
        outcome.seconds = received.len() * travelled.seconds() as usize;
        outcome
    }
}
