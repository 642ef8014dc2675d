//! Readings that no vehicle can have.
//!
//! A part without a checksum, or with a short one, delivers a wrong bit as a reading. The largest
//! steps from one sample to the next on the six drives of training and validation are 0.46 rad/s
//! and 10.9 m/s^2.

use crate::sample::ImuSample;
use crate::units::{AngularRate, SpecificForce};

/// Largest step of a gyro axis in 10 ms: 1 rad/s.
pub const JUMP_RATE: AngularRate = AngularRate(1 << AngularRate::FRACTION_BITS);
/// Largest step of an accelerometer axis in 10 ms: 30 m/s^2.
pub const JUMP_FORCE: SpecificForce = SpecificForce(30 << 20);
/// So many readings in a row are not believed; the next one is, wherever it is.
pub const JUMP_PATIENCE: u8 = 3;
/// A reading that is older says nothing of this one, microseconds.
const OLD_US: u64 = 50_000;

/// The last reading that was believed.
#[derive(Debug, Clone, Default)]
pub(super) struct Jump {
    believed: Option<ImuSample>,
    doubted: u8,
}

impl Jump {
    /// Takes a sample; whether it is not to be believed.
    pub fn process(&mut self, sample: &ImuSample) -> bool {
        let jumps = self.believed.as_ref().is_some_and(|believed| jumps(believed, sample));
        if jumps && self.doubted < JUMP_PATIENCE {
            self.doubted += 1;
            return true;
        }
        self.doubted = 0;
        self.believed = Some(*sample);
        false
    }
}

fn jumps(from: &ImuSample, to: &ImuSample) -> bool {
    let age = to.time.0.abs_diff(from.time.0);
    let rates = from.angular_rate.iter().zip(to.angular_rate);
    let forces = from.specific_force.iter().zip(to.specific_force);
    let turns = |(from, to): (&AngularRate, AngularRate)| from.0.abs_diff(to.0) > JUMP_RATE.0.unsigned_abs();
    let strikes =
        |(from, to): (&SpecificForce, SpecificForce)| from.0.abs_diff(to.0) > JUMP_FORCE.0.unsigned_abs();
    age <= OLD_US && (rates.into_iter().any(turns) || forces.into_iter().any(strikes))
}
