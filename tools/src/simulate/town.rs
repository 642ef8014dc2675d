//! This module makes a way through a town: blocks of streets of different speed, some bent, and junctions at which the
//! driver waits, goes straight on, or turns.
//!
//! Corners are as fast as comfort allows: the tightest point of a corner and the lateral
//! acceleration give the speed.

use super::leg::Leg;
use super::purpose::Purpose;
use crate::random::Random;
use std::collections::VecDeque;
use std::f64::consts::FRAC_PI_2;

/// Holds the parameters of the town and its traffic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Speed limits, m/s, each with the share of the streets that have it.
    pub limits: [(f64, f64); 3],
    /// Length of a block, m, from and to; the faster streets have the longer ones.
    pub block: [f64; 2],
    /// Share of the blocks that bend.
    pub bends: f64,
    /// Share of the junctions at which one has to wait.
    pub stops: f64,
    /// The duration of a wait, s, from and to.
    pub wait: [f64; 2],
    /// Share of the junctions at which one turns, to the left and to the right.
    pub turns: [f64; 2],
    /// Length of a left and of a right corner, m, from and to.
    pub corner: [[f64; 2]; 2],
    /// Comfortable lateral acceleration, m/s^2.
    pub lateral: f64,
    /// The time at rest before it sets off, s, from and to.
    pub before: [f64; 2],
}

/// Generates a way through a town without end.
#[derive(Debug, Clone)]
pub struct Town {
    config: Config,
    random: Random,
    legs: VecDeque<Leg>,
}

impl Town {
    /// Makes the way of a seed.
    #[must_use]
    pub fn new(config: &Config, seed: u64) -> Self {
        let mut random = Purpose::Route.stream(seed);
        let [from, to] = config.before;
        let first = Leg::Stand { seconds: random.between(from, to) };
        Self { config: *config, random, legs: VecDeque::from([first]) }
    }

    fn block(&mut self) {
        let Config { limits, block: [from, to], bends, stops, wait, turns, corner, lateral, .. } =
            self.config;
        let random = &mut self.random;
        let pick = random.between(0.0, 1.0);
        let slowest = limits[0].0;
        let (mut share, mut limit) = (0.0, slowest);
        for (speed, part) in limits {
            if pick >= share {
                limit = speed;
            }
            share += part;
        }
        // Drivers deviate from the limit, and from each other.
        let speed = limit * random.between(0.85, 1.05);
        let metres = random.between(from, to) * limit / slowest;
        let bent = random.between(0.0, 1.0) < bends;
        let sign = if random.between(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
        // A bend must be drivable at the street's speed.
        let sharpest = 0.5 * lateral * metres / (2.0 * speed * speed);
        let turn = if bent { sign * random.between(0.1, 0.9) * sharpest.min(1.0) } else { 0.0 };
        self.legs.push_back(Leg::Road { metres, speed, turn });
        if random.between(0.0, 1.0) < stops {
            self.legs.push_back(Leg::Stand { seconds: random.between(wait[0], wait[1]) });
        }
        let pick = random.between(0.0, 1.0);
        let side = if pick < turns[0] {
            0
        } else if pick < turns[0] + turns[1] {
            1
        } else {
            return;
        };
        let metres = random.between(corner[side][0], corner[side][1]);
        let turn = FRAC_PI_2 * random.between(0.9, 1.1);
        let speed = (lateral * metres / (2.0 * turn)).sqrt() * random.between(0.8, 1.0);
        self.legs.push_back(Leg::Road { metres, speed, turn: if side == 0 { turn } else { -turn } });
    }
}

impl Iterator for Town {
    type Item = Leg;

    fn next(&mut self) -> Option<Leg> {
        if self.legs.is_empty() {
            self.block();
        }
        self.legs.pop_front()
    }
}
