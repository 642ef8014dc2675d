//! The moving variance of the low-passed inertial sensor, as evidence of standstill.
//!
//! An engine shakes a standing vehicle at tens of hertz, a road shakes a driven one at less than five. So means over
//! 100 ms, with triangular weights, keep the road and lose the engine. The published detectors (moving variance, angular
//! rate energy, SHOE: Skog, Handel, Nilsson and Rantakokko, IEEE Trans. Biomed. Eng. 57, 2010) take more motion for
//! standing on raw samples (the test `standstill_detectors` prints how much).

use crate::sample::ImuSample;
use crate::sqrt::sqrt;
use crate::units::{AngularRate, SpecificForce};

/// Weights of the samples in a mean, and their sum.
const WEIGHTS: [i64; 10] = [1, 2, 3, 4, 5, 5, 4, 3, 2, 1];
const WEIGHT: f32 = 30.0;
/// Means in a window: 2 s.
const WINDOW: usize = 20;
const BATCH_SECONDS: f32 = 0.1;
/// Time over which the force before the window is averaged, s.
const BEFORE: f32 = 3.0;

/// Values about or along x, y and z.
pub type Axes = [f32; 3];

/// The motion of the newest window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Root of the sum of the gyro axes' variances, rad/s.
    pub shake: f32,
    /// Largest change of the speed within the window against a steady change, all axes, m/s.
    pub speed_change: f32,
    /// Change of speed by the mean force of the 3 s before the window against that in it, m/s; `None` before there were
    /// any.
    pub speed_lost: Option<Axes>,
    /// Mean force of the window, and of its last half second, m/s^2.
    pub force: Axes,
    pub newest: Axes,
}

/// Collects the samples of the window.
#[derive(Debug, Clone)]
pub struct Inertial {
    /// Weighted sums of the current mean, codes, and its samples.
    sums: [[i64; 3]; 2],
    count: usize,
    gyro: [Axes; WINDOW],
    force: [Axes; WINDOW],
    filled: usize,
    /// Mean force before the window, m/s^2.
    before: Option<Axes>,
}

impl Inertial {
    /// The state before the first sample.
    pub const START: Self = Self {
        sums: [[0; 3]; 2],
        count: 0,
        gyro: [[0.0; 3]; WINDOW],
        force: [[0.0; 3]; WINDOW],
        filled: 0,
        before: None,
    };

    /// Adds a sample; returns the motion each 100 ms once the window is full.
    pub fn add(&mut self, sample: &ImuSample) -> Option<Motion> {
        let [gyro, force] = &mut self.sums;
        let weight = WEIGHTS.get(self.count).copied().unwrap_or_default();
        gyro.iter_mut().zip(sample.angular_rate).for_each(|(sum, axis)| *sum += weight * i64::from(axis.0));
        force
            .iter_mut()
            .zip(sample.specific_force)
            .for_each(|(sum, axis)| *sum += weight * i64::from(axis.0));
        self.count += 1;
        if self.count < WEIGHTS.len() {
            return None;
        }
        self.count = 0;
        let [gyro, force] = core::mem::take(&mut self.sums);
        let mean = |sum: [i64; 3], per_unit: f32| sum.map(|sum| sum as f32 / (WEIGHT * per_unit));
        if self.filled == WINDOW {
            self.leave();
        }
        self.gyro.rotate_left(1);
        self.force.rotate_left(1);
        self.gyro[WINDOW - 1] = mean(gyro, AngularRate::PER_RAD_PER_SEC);
        self.force[WINDOW - 1] = mean(force, SpecificForce::PER_METRE_PER_SEC2);
        self.filled = (self.filled + 1).min(WINDOW);
        (self.filled == WINDOW).then(|| self.motion())
    }

    /// Adds the oldest mean, which leaves the window, to the force before it.
    fn leave(&mut self) {
        let [oldest, ..] = self.force;
        let before = self.before.get_or_insert(oldest);
        let part = BATCH_SECONDS / BEFORE;
        before.iter_mut().zip(oldest).for_each(|(before, oldest)| *before += part * (oldest - *before));
    }

    fn motion(&self) -> Motion {
        let (mut variance, mut change) = (0.0, 0.0);
        let mut lost = self.before;
        let (rates, forces) = (mean_of(&self.gyro), mean_of(&self.force));
        for axis in 0..3 {
            let (rate, force) = (rates[axis], forces[axis]);
            let (mut speed, mut least, mut largest) = (0.0f32, 0.0f32, 0.0f32);
            for (gyro, newest) in self.gyro.iter().zip(&self.force) {
                let off = gyro[axis] - rate;
                variance += off * off / WINDOW as f32;
                speed += BATCH_SECONDS * (newest[axis] - force);
                (least, largest) = (least.min(speed), largest.max(speed));
            }
            change += (largest - least) * (largest - least);
            if let (Some(lost), Some(before)) = (&mut lost, self.before) {
                lost[axis] = BEFORE * (before[axis] - force);
            }
        }
        let newest = mean_of(self.force.rchunks(WINDOW / 4).next().unwrap_or(&[]));
        let (shake, speed_change) = (sqrt(variance), sqrt(change));
        Motion { shake, speed_change, speed_lost: lost, force: forces, newest }
    }
}

fn mean_of(window: &[Axes]) -> Axes {
    let mut sums = [0.0; 3];
    for values in window {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
    sums.map(|sum| sum / window.len().max(1) as f32)
}
