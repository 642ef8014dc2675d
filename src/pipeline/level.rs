//! The rotation beyond the configured mounting, which follows the vertical that standstills and turns have shown.
//!
//! It follows slowly, so that neither a rate nor a window of the network jumps.

use super::sensor_bias::ZeroPoint;
use super::{Pipeline, PipelineConfig};
use crate::bias::EarthRate;
use crate::mounting::{Judgement, Rotation, Vertical, VerticalEstimator};
use crate::sample::ImuSample;
use crate::units::{AngularRate, SpecificForce};
use crate::vector::norm;

/// Samples between two steps, and the largest step: 3 degrees in a second.
const STEP_SAMPLES: u32 = 5;
const STEP: f32 = 2.6e-3;
/// Where a configured sensor's z axis points.
const Z: [f32; 3] = [0.0, 0.0, 1.0];

#[derive(Debug, Clone)]
pub(super) struct Level {
    /// `None` where a calibration has measured the tilt.
    estimator: Option<VerticalEstimator>,
    /// Up, as the sensor is mounted: where it should be, and where it is taken to be.
    goal: [f32; 3],
    up: [f32; 3],
    pub(super) rotation: Rotation,
    rest: [AngularRate; 3],
    samples: u32,
    /// Variance of the direction of the axis in use, rad^2.
    variance: f32,
    reported: Vertical,
}

impl Level {
    /// Starts with the rates at rest, the force at rest unless the vehicle moves, and what earlier drives showed.
    pub(super) fn new(
        rest: [AngularRate; 3],
        force: Option<&[SpecificForce; 3]>,
        known: Option<Vertical>,
    ) -> Self {
        let mut level = Self {
            estimator: known.map(VerticalEstimator::new),
            goal: Z,
            up: Z,
            rotation: Rotation::IDENTITY,
            rest,
            samples: 0,
            variance: 0.0,
            reported: Vertical::UNKNOWN,
        };
        if let Some(estimator) = &mut level.estimator {
            force.into_iter().for_each(|force| estimator.rest(force));
            let judgement = estimator.judge();
            level.take(judgement);
            level.up = level.goal;
            level.rotation = Rotation::upright(&level.up);
        }
        level
    }

    pub(super) fn rates_at_rest(&self) -> [AngularRate; 3] {
        self.rotation.rate(self.rest)
    }

    /// Returns the same, of which the Earth's rate is a part.
    pub(super) fn zero(&self, earth: EarthRate) -> ZeroPoint {
        ZeroPoint::at_rest(self.rates_at_rest(), earth)
    }

    /// Adds a sample that is not levelled yet. Returns true where the rotation has changed.
    pub(super) fn add(&mut self, sample: &ImuSample, stands: bool) -> bool {
        let rates = core::array::from_fn(|axis| {
            AngularRate(sample.angular_rate[axis].0.saturating_sub(self.rest[axis].0))
        });
        let Some(estimator) = &mut self.estimator else { return false };
        if !sample.validity.is_good() {
            estimator.restart();
        } else if estimator.add(&sample.specific_force, &rates, stands) {
            let judgement = estimator.judge();
            self.take(judgement);
        }
        self.samples = (self.samples + 1) % STEP_SAMPLES;
        self.samples == 0 && self.follow()
    }

    fn take(&mut self, judgement: Judgement) {
        self.goal = judgement.up.unwrap_or(Z);
        self.variance = judgement.variance;
    }

    fn follow(&mut self) -> bool {
        let way: [f32; 3] = core::array::from_fn(|axis| self.goal[axis] - self.up[axis]);
        let length = norm(&way);
        if length <= 1e-6 {
            return false;
        }
        let part = (STEP / length).min(1.0);
        let up: [f32; 3] = core::array::from_fn(|axis| self.up[axis] + part * way[axis]);
        let norm = norm(&up).max(0.1);
        self.up = if part < 1.0 { up.map(|axis| axis / norm) } else { self.goal };
        self.rotation = Rotation::upright(&self.up);
        true
    }

    pub(super) fn restart(&mut self) {
        if let Some(estimator) = &mut self.estimator {
            estimator.restart();
        }
    }

    pub(super) fn vertical(&self) -> Option<&Vertical> {
        self.estimator.as_ref().map(VerticalEstimator::known)
    }
}

impl Pipeline {
    /// Returns what standstills and turns have shown, in the sensor's axes, where it has changed.
    pub(super) fn new_vertical(&mut self) -> Option<Vertical> {
        let PipelineConfig { mounting, .. } = &self.config;
        let level = &mut self.state.initialised.as_mut()?.level;
        let known = *level.vertical()?;
        let is_new = core::mem::replace(&mut level.reported, known) != known;
        is_new.then(|| known.turned(&mounting.inverse()))
    }

    /// Returns the share of a turn that a gyro beside this one, which is not levelled, misses if a tilt in use is a ramp's.
    pub(super) fn ramp(&self) -> f32 {
        let level = self.state.initialised.as_ref().map(|known| &known.level);
        let is_one_place =
            |level: &&Level| level.estimator.as_ref().is_some_and(|estimator| estimator.is_one_place);
        level.filter(is_one_place).map_or(0.0, |level| 1.0 - level.up[2])
    }

    /// Returns the variance of the direction of the axis in use, rad^2, and whether a tilt is taken off.
    pub(super) fn tilt_variance(&self) -> (f32, bool) {
        let known = self.state.initialised.as_ref();
        known.map_or((0.0, false), |known| (known.level.variance, known.level.goal != Z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_turns_by_three_degrees_a_second_until_it_is_upright() {
        let mut level = Level::new([AngularRate::ZERO; 3], None, None);
        assert!(!level.follow(), "it is upright");
        let angle = 10f32.to_radians();
        level.goal = [libm::sinf(angle), 0.0, libm::cosf(angle)];
        for step in 1..=67 {
            assert!(level.follow() && level.up != level.goal);
            // By chords, which are that much shorter than the arc.
            let share = libm::atan2f(level.up[0], level.up[2]) / (STEP * step as f32);
            assert!((0.995..1.0).contains(&share) && (norm(&level.up) - 1.0).abs() < 1e-6, "{step}: {share}");
        }
        assert!(level.follow() && level.up == level.goal && !level.follow());
        // One step for five samples, while the vehicle moves, too.
        level.estimator = Some(VerticalEstimator::new(Vertical::UNKNOWN));
        level.goal = Z;
        let sample = ImuSample {
            time: crate::sample::NO_STAMP,
            specific_force: [SpecificForce(0); 3],
            angular_rate: [AngularRate::ZERO; 3],
            temperature: None,
            validity: crate::sample::Validity::Good,
        };
        let turned = (0..50).filter(|_| level.add(&sample, false)).count();
        assert_eq!(turned, 10);
    }
}
