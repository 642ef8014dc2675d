//! Generates a route through a town: blocks of streets with different speed limits, some curved, and
//! junctions where the driver waits, drives straight on, or turns.
//!
//! The speed in a corner follows from the curvature at its tightest point and the comfortable lateral acceleration.

use gyronet_tools::random::Random;
use gyronet_tools::simulate::leg::Leg;
use gyronet_tools::simulate::purpose::Purpose;
use std::collections::VecDeque;
use std::f64::consts::FRAC_PI_2;

/// Speed limits, m/s, each with the share of the streets that have it.
const LIMITS: [(f64, f64); 3] = [(8.33, 0.35), (13.89, 0.45), (19.44, 0.2)];
/// Smallest and largest length of a block in the slowest streets, m; faster streets have longer blocks.
const BLOCK: [f64; 2] = [60.0, 180.0];
/// Share of the blocks that are curved.
const BENDS: f64 = 0.4;
/// Share of the junctions where the driver waits, and the shortest and longest wait, s.
const STOPS: f64 = 0.4;
const WAIT: [f64; 2] = [5.0, 45.0];
/// Shares of the junctions where the driver turns left, and right.
const TURNS: [f64; 2] = [0.25, 0.3];
/// Smallest and largest length of a left corner and of a right corner, m.
const CORNER: [[f64; 2]; 2] = [[25.0, 35.0], [15.0, 22.0]];
/// Comfortable lateral acceleration, m/s^2.
const LATERAL: f64 = 2.0;
/// Shortest and longest time at rest before the vehicle sets off, s.
const BEFORE: [f64; 2] = [8.0, 15.0];

/// An endless iterator over the legs of a route through a town.
#[derive(Debug, Clone)]
pub struct Town {
    random: Random,
    legs: VecDeque<Leg>,
}

impl Town {
    pub fn new(seed: u64) -> Self {
        let mut random = Purpose::Route.stream(seed);
        let [from, to] = BEFORE;
        let first = Leg::Stand { seconds: random.between(from, to) };
        Self { random, legs: VecDeque::from([first]) }
    }

    fn block(&mut self) {
        let random = &mut self.random;
        let pick = random.between(0.0, 1.0);
        let slowest = LIMITS[0].0;
        let (mut share, mut limit) = (0.0, slowest);
        for (speed, part) in LIMITS {
            if pick >= share {
                limit = speed;
            }
            share += part;
        }
        // Drivers deviate from the limit, and from each other.
        let speed = limit * random.between(0.85, 1.05);
        let metres = random.between(BLOCK[0], BLOCK[1]) * limit / slowest;
        let bent = random.chance(BENDS);
        let sign = random.sign();
        // A bend must be drivable at the street's speed.
        let sharpest = 0.5 * LATERAL * metres / (2.0 * speed * speed);
        let turn = if bent { sign * random.between(0.1, 0.9) * sharpest.min(1.0) } else { 0.0 };
        self.legs.push_back(Leg::Road { metres, speed, turn });
        if random.chance(STOPS) {
            self.legs.push_back(Leg::Stand { seconds: random.between(WAIT[0], WAIT[1]) });
        }
        let pick = random.between(0.0, 1.0);
        let side = if pick < TURNS[0] {
            0
        } else if pick < TURNS[0] + TURNS[1] {
            1
        } else {
            return;
        };
        let metres = random.between(CORNER[side][0], CORNER[side][1]);
        let turn = FRAC_PI_2 * random.between(0.9, 1.1);
        let speed = (LATERAL * metres / (2.0 * turn)).sqrt() * random.between(0.8, 1.0);
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
