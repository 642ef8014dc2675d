//! The moving variance of the low-passed inertial sensor, as evidence of standstill.
//!
//! An engine shakes a standing vehicle at nine to some tens of hertz, a road a driven one at less than five. So means
//! over 200 ms every 100 ms, weighted by a Hann window (at most 1 % is left from 10 Hz on), keep the road and lose the
//! engine. The published detectors (Skog, Handel, Nilsson and Rantakokko, IEEE Trans. Biomed. Eng. 57, 2010) take more
//! motion for standing on raw samples (the test `standstill_detectors` prints how much).

use crate::sample::ImuSample;
use crate::sqrt::sqrt;
use crate::units::{AngularRate, SpecificForce};

/// Weights of a batch's samples in the mean that begins with it; in the one that ends with it they fall. Then their sum.
const RISING: [i32; 10] = [1, 9, 24, 44, 68, 94, 118, 138, 153, 161];
const WEIGHT: f32 = 1_620.0;
/// Means in a window: 2 s.
pub(super) const WINDOW: usize = 20;
const BATCH_SECONDS: f32 = 0.1;
/// Time over which the force before the window is averaged, s.
const BEFORE: f32 = 3.0;

pub type Axes = [f32; 3];

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Root of the sum of the gyro axes' variances, rad/s.
    pub shake: f32,
    /// Largest change of the speed within the window against a steady change, all axes, m/s.
    pub speed_change: f32,
    /// Change of speed by the 3 s before the window against the force in it, m/s; `None` before there were any.
    pub speed_lost: Option<Axes>,
    /// Mean force of the window, and of its last half second, m/s^2.
    pub force: Axes,
    pub newest: Axes,
}

#[derive(Debug, Clone)]
pub struct Inertial {
    /// Weighted sums of the current mean, and of the next one, codes: gyro and force. Then the batch's samples.
    sums: [[[i64; 3]; 2]; 2],
    count: usize,
    gyro: [Axes; WINDOW],
    force: [Axes; WINDOW],
    filled: usize,
    is_whole: bool,
    /// Mean force before the window, m/s^2.
    before: Option<Axes>,
}

impl Inertial {
    pub const START: Self = Self {
        sums: [[[0; 3]; 2]; 2],
        count: 0,
        gyro: [[0.0; 3]; WINDOW],
        force: [[0.0; 3]; WINDOW],
        filled: 0,
        is_whole: false,
        before: None,
    };

    /// Adds a sample; returns the motion each 100 ms once the window is full.
    pub fn add(&mut self, sample: &ImuSample) -> Option<Motion> {
        let weight = |at: usize| RISING.get(at).copied().unwrap_or_default();
        let weights = [weight((RISING.len() - 1).saturating_sub(self.count)), weight(self.count)];
        self.count += 1;
        let codes = [sample.angular_rate.map(|rate| rate.0), sample.specific_force.map(|force| force.0)];
        let ([falling, rising], [current, next]) = (weights.map(i64::from), &mut self.sums);
        let sums = current.as_flattened_mut().iter_mut().zip(next.as_flattened_mut());
        for ((current, next), code) in sums.zip(codes.as_flattened()) {
            *current += falling * i64::from(*code);
            *next += rising * i64::from(*code);
        }
        if self.count < RISING.len() {
            return None;
        }
        self.count = 0;
        let [[gyro, force], next] = self.sums;
        self.sums = [next, [[0; 3]; 2]];
        if !core::mem::replace(&mut self.is_whole, true) {
            return None;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Validity;
    use crate::units::Micros;

    /// The shake of a vehicle that turns to and fro at a frequency, by its amplitude.
    fn shake(hertz: f32) -> f32 {
        let mut inertial = Inertial::START;
        let mut shake = 0.0f32;
        for step in 0..1_000u64 {
            let phase = core::f32::consts::TAU * hertz * step as f32 / 100.0;
            let rate = AngularRate::from_rad_per_sec(0.02 * libm::sinf(phase)).unwrap();
            let sample = ImuSample {
                time: Micros(step * 10_000),
                angular_rate: [rate; 3],
                specific_force: [SpecificForce(0); 3],
                temperature: None,
                validity: Validity::Good,
            };
            let motion = inertial.add(&sample);
            shake = shake.max(motion.map_or(0.0, |motion| motion.shake / 0.02 / 1.225));
        }
        shake
    }

    #[test]
    fn an_engine_is_left_out_and_a_road_is_not() {
        for hertz in [1.2, 1.6, 2.2] {
            assert!(shake(hertz) > 0.8, "{hertz} Hz: {}", shake(hertz));
        }
        for (hertz, most) in [(9.0, 0.08), (11.0, 0.03), (18.0, 0.01), (23.4, 0.01)] {
            assert!(shake(hertz) < most, "{hertz} Hz: {}", shake(hertz));
        }
    }
}
