//! Faults that show in successive readings only: they repeat themselves, or are further apart than a vehicle moves.
//!
//! A working part has noise, a stuck one has none. A part without a checksum, or with a short one, passes a flipped bit on
//! as a reading. A limit on the step between samples finds it, because a vehicle moves far less in 10 ms: the largest steps
//! from one sample to the next on the six drives of training and validation are 0.46 rad/s and 10.9 m/s^2.

use crate::sample::ImuSample;
use crate::units::{AngularRate, SpecificForce};

/// The part counts as stuck after this many samples in a row that equal the one before: in all axes of the gyro, in
/// all of the accelerometer, or in one axis that rarely repeats a reading.
///
/// With noise of half a bit an axis at rest repeats nearly every second reading. Even then three axes repeat seven
/// times in a row only once in two days, and once in months where an axis repeats one reading in thirty. No
/// delayed rate of these samples has been sent yet.
pub const STUCK_AFTER: u8 = 7;
/// An axis that often repeats a reading counts as stuck after this many equal samples in a row.
pub const AXIS_STUCK_AFTER: u8 = 30;

/// The axes are accelerometer x, y, z, then gyro x, y, z.
const AXES: usize = 6;
/// Samples over which the frequency of repetitions is averaged, as a power of two.
const AVERAGE: u32 = 8;
const ALWAYS: u16 = 1 << 15;
/// An axis whose share of repetitions is below this normally has enough noise; the share includes the last
/// [`STUCK_AFTER`] samples.
const SELDOM: u16 = ALWAYS / 16;

/// Counts how often each axis repeats a reading.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    last: Option<[i32; AXES]>,
    /// Samples in a row that were equal to the one before.
    equal: [u8; AXES],
    /// Running share of repeated samples; [`ALWAYS`] stands for all of them.
    repeats: [u16; AXES],
    stuck: [bool; AXES],
}

impl Repeats {
    /// Creates the state in which every axis counts as a coarse one with frequent repetitions.
    pub const fn new() -> Self {
        Self { last: None, equal: [0; AXES], repeats: [ALWAYS; AXES], stuck: [false; AXES] }
    }

    /// Adds a sample and returns whether the part is stuck.
    pub fn observe(&mut self, sample: &ImuSample) -> bool {
        let ([fx, fy, fz], [wx, wy, wz]) = (sample.specific_force, sample.angular_rate);
        let axes = [fx.0, fy.0, fz.0, wx.0, wy.0, wz.0];
        let last = self.last.replace(axes);
        let pairs = last.unwrap_or(axes).into_iter().zip(axes);
        let counts = self.equal.iter_mut().zip(&mut self.repeats).zip(&mut self.stuck);
        for ((before, now), ((equal, repeats), stuck)) in pairs.zip(counts) {
            let repeated = last.is_some() && before == now;
            *equal = if repeated { equal.saturating_add(1) } else { 0 };
            *repeats -= *repeats >> AVERAGE;
            *repeats += if repeated { ALWAYS >> AVERAGE } else { 0 };
            let seldom = *repeats < SELDOM && *equal >= STUCK_AFTER;
            *stuck = repeated && (*stuck || seldom || *equal >= AXIS_STUCK_AFTER);
        }
        let (accelerometer, gyro) = self.equal.split_at(AXES / 2);
        let stands = |part: &[u8]| part.iter().all(|equal| *equal >= STUCK_AFTER);
        stands(accelerometer) || stands(gyro) || self.stuck.contains(&true)
    }
}

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
