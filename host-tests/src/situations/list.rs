//! The situations: `places` where a vehicle is, `roads` and how it is driven, `parts` and what fails.

mod parts;
mod places;
mod roads;

use super::judge::Outcome;
use super::scene::Scene;
use super::vehicle::{BARE, CAR, HATCH, TRUCK, UTV, VAN, Vehicle};

pub struct Situation {
    pub name: &'static str,
    /// Vehicles in which it happens; the test takes the first.
    pub vehicles: &'static [Vehicle],
    pub set: fn(&mut Scene),
}

const ALL: &[Vehicle] = &[CAR, HATCH, TRUCK, UTV, BARE, VAN];
const WHEELED: &[Vehicle] = &[CAR, HATCH, TRUCK, VAN];
const WITHOUT: &[Vehicle] = &[BARE, UTV];

impl Situation {
    const fn new(name: &'static str, vehicles: &'static [Vehicle], set: fn(&mut Scene)) -> Self {
        Self { name, vehicles, set }
    }

    pub fn run(&self, vehicle: &Vehicle, seed: u64) -> Outcome {
        let mut scene = Scene::new(vehicle, seed);
        (self.set)(&mut scene);
        scene.run()
    }
}

pub fn all() -> impl Iterator<Item = &'static Situation> {
    [places::SITUATIONS, roads::SITUATIONS, parts::SITUATIONS].into_iter().flatten()
}
