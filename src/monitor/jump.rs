//! This module finds readings that no vehicle can produce.
//!
//! A part without a checksum, or with a short one, passes a flipped bit on as a reading. A limit on the step between
//! samples finds it, because a vehicle moves far less in 10 ms: the largest steps from one sample to the next on the
//! six drives of training and validation are 0.46 rad/s and 10.9 m/s^2.

use crate::sample::ImuSample;
use crate::units::{AngularRate, SpecificForce};

/// The largest plausible step of a gyro axis in 10 ms is 1 rad/s.
pub const JUMP_RATE: AngularRate = AngularRate(1 << AngularRate::FRACTION_BITS);
/// The largest plausible step of an accelerometer axis in 10 ms is 30 m/s^2.
pub const JUMP_FORCE: SpecificForce = SpecificForce(30 << 20);
/// At most this many readings in a row are rejected; the next one is accepted whatever its value.
pub const JUMP_PATIENCE: u8 = 3;
/// Readings are not compared with a last good reading older than this, microseconds.
const OLD_US: u32 = 50_000;

/// Compares each reading with the last accepted one.
#[derive(Debug, Clone)]
pub(super) struct Jump {
    angular_rate: [AngularRate; 3],
    specific_force: [SpecificForce; 3],
    /// Time of the last accepted reading, microseconds modulo 2^32.
    at: u32,
    known: bool,
    /// Readings in a row that were rejected.
    rejected: u8,
}

impl Jump {
    /// Creates the state before the first reading.
    pub const fn new() -> Self {
        let (angular_rate, specific_force) = ([AngularRate::ZERO; 3], [SpecificForce(0); 3]);
        Self { angular_rate, specific_force, at: 0, known: false, rejected: 0 }
    }

    /// Checks a reading and returns whether it is too far from the last accepted one; otherwise it is accepted.
    pub fn check(&mut self, sample: &ImuSample) -> bool {
        if self.known && self.jumps(sample) && self.rejected < JUMP_PATIENCE {
            self.rejected += 1;
            return true;
        }
        let ImuSample { angular_rate, specific_force, time, .. } = *sample;
        *self = Self { angular_rate, specific_force, at: time.0 as u32, known: true, rejected: 0 };
        false
    }

    fn jumps(&self, to: &ImuSample) -> bool {
        let age = (to.time.0 as u32).wrapping_sub(self.at) as i32;
        let rates = self.angular_rate.iter().zip(to.angular_rate);
        let forces = self.specific_force.iter().zip(to.specific_force);
        let mut far = rates.map(|(from, to)| from.0.abs_diff(to.0) > JUMP_RATE.0.unsigned_abs());
        let mut hard = forces.map(|(from, to)| from.0.abs_diff(to.0) > JUMP_FORCE.0.unsigned_abs());
        age.unsigned_abs() <= OLD_US && (far.any(|far| far) || hard.any(|hard| hard))
    }
}
