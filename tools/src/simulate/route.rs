//! Generates the driver's route: streets with bends, wide corners and stops, one after another.
//!
//! The car turns at no more than about 0.3 rad/s, as in the recordings, and never parks.

use super::leg::Leg;
use super::purpose::Purpose;
use crate::random::Random;
use std::f64::consts::FRAC_PI_2;

#[derive(Debug, Clone)]
pub struct Route {
    random: Random,
    legs: u32,
    /// Side of the next corner: +1 is left.
    side: f64,
    /// Number of legs before the motorway.
    streets: u32,
}

impl Route {
    pub fn new(seed: u64) -> Self {
        let mut random = Purpose::Route.stream(seed);
        let side = random.sign();
        Self { random, legs: 0, side, streets: u32::MAX }
    }

    /// Streets with four stops, then a motorway without a stop.
    pub fn onto_motorway(seed: u64) -> Self {
        Self { streets: 24, ..Self::new(seed) }
    }
}

impl Iterator for Route {
    type Item = Leg;

    /// Returns the next leg: a stop first, then streets, corners and a bend, a stop, and so on.
    fn next(&mut self) -> Option<Leg> {
        let between = |random: &mut Random, low, high| random.between(low, high);
        let random = &mut self.random;
        if self.legs >= self.streets {
            return Some(Leg::Road {
                metres: between(random, 600.0, 1500.0),
                speed: between(random, 26.0, 34.0),
                turn: between(random, -0.35, 0.35),
            });
        }
        let place = self.legs % 6;
        self.legs += 1;
        Some(match place {
            0 if self.legs == 1 => Leg::Stand { seconds: between(random, 5.5, 7.0) },
            0 => Leg::Stand { seconds: between(random, 3.0, 6.0) },
            1 | 3 => Leg::Road {
                metres: between(random, 60.0, 110.0),
                speed: between(random, 10.0, 15.0),
                turn: 0.0,
            },
            2 | 5 => {
                let turn = self.side * between(random, 0.85, 1.1) * FRAC_PI_2;
                self.side = -self.side;
                Leg::Road { metres: between(random, 55.0, 75.0), speed: between(random, 4.5, 6.0), turn }
            }
            _ => {
                let turn = random.sign() * between(random, 0.25, 0.7);
                Leg::Road { metres: between(random, 90.0, 140.0), speed: between(random, 10.0, 14.0), turn }
            }
        })
    }
}
