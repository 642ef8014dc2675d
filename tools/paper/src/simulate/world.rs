//! Computes the truth: position and heading of the vehicle, and the readings of perfect sensors.
//!
//! The world's axes are x east, y north, z up. Heading is counted from east to the left, pitch is nose down, roll is
//! left side up, in that order. Rates are constant over each 10 ms, so the truth at the grid steps is exact: the yaw is
//! the sum of the heading rates.
//!
//! The tyres of the rear axle slip sideways in a turn, by an angle proportional to the lateral acceleration
//! (Rajamani, Vehicle Dynamics and Control, chapter 2): the course over ground differs from the heading.

use super::town::Town;
use super::vehicles::{CAR, LATITUDE_DEG};
use gyronet_tools::drive::DT;
use gyronet_tools::simulate::car::{self, Car, GRAVITY, Motion};
use gyronet_tools::simulate::vibration::{Shake, Vibration};

/// Rotation rate of the Earth, rad/s (WGS 84).
pub const EARTH_RATE: f64 = 7.292_115e-5;

/// Normalised cornering stiffness of the rear axle: lateral acceleration over g for 1 rad.
const CORNERING_STIFFNESS: f64 = 20.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    pub seconds: f64,
    /// Position relative to the start, m.
    pub position: [f64; 3],
    /// Heading, not wrapped, rad.
    pub yaw: f64,
    pub motion: Motion,
    /// Angular rate relative to inertial space, in vehicle axes and without vibration, rad/s.
    pub inertial_rate: [f64; 3],
    pub shake: Shake,
}

impl Truth {
    /// Converts a vector from the world's axes to the vehicle's.
    pub fn in_vehicle(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = (libm::sin(self.yaw), libm::cos(self.yaw));
        car::turned_in([x * cos + y * sin, y * cos - x * sin, z], self.motion.pitch, self.motion.roll)
    }

    /// Returns the rotation from the vehicle's axes to the world's, row by row.
    pub fn rotation(&self) -> [[f64; 3]; 3] {
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| self.in_vehicle(axis))
    }
}

/// An endless iterator over the truth of a drive, every 10 ms.
#[derive(Debug, Clone)]
pub struct World {
    car: Car<Town>,
    vibration: Vibration,
    tick: u32,
    position: [f64; 3],
    yaw: f64,
}

impl World {
    /// Starts at rest with the heading `yaw`.
    pub fn new(way: Town, yaw: f64, run: u64) -> Self {
        Self {
            car: Car::on(&CAR, way, run),
            vibration: Vibration::new(run),
            tick: 0,
            position: [0.0; 3],
            yaw,
        }
    }

    fn drive(&mut self, motion: &Motion) {
        let before = self.yaw;
        self.yaw += motion.heading_rate * DT;
        let lateral = motion.speed * motion.heading_rate;
        let side_slip = lateral / (GRAVITY * CORNERING_STIFFNESS);
        let course = (before + self.yaw) / 2.0 - side_slip;
        let level = motion.speed * libm::cos(motion.grade) * DT;
        self.position[0] += level * libm::cos(course);
        self.position[1] += level * libm::sin(course);
        self.position[2] -= motion.speed * libm::sin(motion.grade) * DT;
    }
}

impl Iterator for World {
    type Item = Truth;

    fn next(&mut self) -> Option<Truth> {
        let motion = self.car.step();
        self.drive(&motion);
        let shake = self.vibration.step(motion.speed);
        let seconds = f64::from(self.tick) * DT;
        self.tick += 1;
        let (position, yaw) = (self.position, self.yaw);
        let inertial_rate = motion.angular_rate;
        let mut truth = Truth { seconds, position, yaw, motion, inertial_rate, shake };
        let latitude = LATITUDE_DEG.to_radians();
        let earth =
            truth.in_vehicle([0.0, EARTH_RATE * libm::cos(latitude), EARTH_RATE * libm::sin(latitude)]);
        truth.inertial_rate = gyronet_tools::simulate::add(motion.angular_rate, earth);
        Some(truth)
    }
}
