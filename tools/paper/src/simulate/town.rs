//! Generates a route through a town: blocks of streets with different speed limits, some curved, and
//! junctions where the driver waits, drives straight on, or turns.
//!
//! The speed in a corner follows from the curvature at its tightest point and the comfortable lateral acceleration.

use gyronet_tools::random::Random;
use gyronet_tools::simulate::leg::Leg;
use gyronet_tools::simulate::purpose::Purpose;
use std::collections::VecDeque;
use std::f64::consts::FRAC_PI_2;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Speed limits, m/s, each with the share of the streets that have it.
    pub limits: [(f64, f64); 3],
    /// Smallest and largest length of a block in the slowest streets, m; faster streets have longer blocks.
    pub block: [f64; 2],
    /// Share of the blocks that are curved.
    pub bends: f64,
    /// Share of the junctions where the driver waits.
    pub stops: f64,
    /// Shortest and longest wait, s.
    pub wait: [f64; 2],
    /// Shares of the junctions where the driver turns left, and right.
    pub turns: [f64; 2],
    /// Smallest and largest length of a left corner and of a right corner, m.
    pub corner: [[f64; 2]; 2],
    /// Comfortable lateral acceleration, m/s^2.
    pub lateral: f64,
    /// Shortest and longest time at rest before the vehicle sets off, s.
    pub before: [f64; 2],
}

/// An endless iterator over the legs of a route through a town.
#[derive(Debug, Clone)]
pub struct Town {
    config: Config,
    random: Random,
    legs: VecDeque<Leg>,
}

impl Town {
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
