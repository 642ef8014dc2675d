//! Detects standstill by the inertial sensors where no wheel speeds are available, within tighter limits
//! than at the start.
//!
//! A steady turn looks like a bias, so an estimator that trusts a quiet gyro takes slow turns for bias and drifts
//! more than without an update. The limits here are therefore never wider than those of static initialisation, and
//! standard deviations must also stay within a multiple of what this vehicle showed at rest at the start. Quiet is
//! asserted after several whole seconds whose means agree with the first one's, axis by axis, so that a turn that
//! begins slowly ends it. The mean must also be plausible for the bias: [`super::zero_rate`] checks that, within a
//! gate that narrows as the bias becomes known.

use super::static_init::{Rest, StaticConfig};
use crate::sample::{ImuSample, RATE_HZ};
use crate::sqrt::sqrt;
use crate::units::{AngularRate, SpecificForce};

/// Limits that are tighter than those of static initialisation.
#[derive(Debug, Clone, Copy)]
pub struct QuietConfig {
    /// Largest standard deviation over that of static initialisation.
    pub std_ratio: f32,
    /// Largest change of a gyro axis' one-second mean, rad/s.
    pub gyro_drift: f32,
    /// Largest change of an accelerometer axis' one-second mean, m/s^2.
    pub accel_drift: f32,
    /// Whole seconds before quiet is asserted.
    pub seconds: u8,
}

impl QuietConfig {
    /// These limits suit a car whose engine may run. The test `quiet_stretches` holds them against eight real
    /// drives.
    pub const DEFAULT: Self = Self { std_ratio: 1.5, gyro_drift: 7e-4, accel_drift: 0.06, seconds: 3 };
}

/// Six axes, gyro first: values in rad/s and m/s^2.
type Axes = [f32; 6];

/// Detects standstill by the inertial sensors.
#[derive(Debug, Clone)]
pub struct QuietDetector {
    std: Axes,
    drift: Axes,
    seconds: u8,
    block: [Spread; 6],
    /// Means of the first second of the run.
    first: Option<Axes>,
    run: u8,
}

impl QuietDetector {
    /// Creates a detector with limits for a vehicle that showed `rest` at the start; they are never above those of
    /// static initialisation.
    #[must_use]
    pub fn new(config: QuietConfig, limits: &StaticConfig, rest: &Rest) -> Self {
        let gyro = |axis: usize| (config.std_ratio * rest.gyro_std[axis]).min(limits.gyro_std);
        let accel = |axis: usize| (config.std_ratio * rest.accel_std[axis]).min(limits.accel_std);
        let gyro_drift = config.gyro_drift.min(limits.gyro_drift);
        let accel_drift = config.accel_drift.min(limits.accel_drift);
        Self {
            std: [gyro(0), gyro(1), gyro(2), accel(0), accel(1), accel(2)],
            drift: [gyro_drift, gyro_drift, gyro_drift, accel_drift, accel_drift, accel_drift],
            seconds: config.seconds.max(1),
            block: [Spread::default(); 6],
            first: None,
            run: 0,
        }
    }

    /// Adds a sample. Returns whether the vehicle has been quiet, up to the last whole second.
    pub fn observe(&mut self, sample: &ImuSample) -> bool {
        let [block_x, ..] = &self.block;
        let count = block_x.count() + 1;
        let (gyro, accel) = self.block.split_at_mut(3);
        for (spread, rate) in gyro.iter_mut().zip(sample.angular_rate) {
            spread.add(rate.0, rate.0 as f32 / AngularRate::PER_RAD_PER_SEC);
        }
        for (spread, force) in accel.iter_mut().zip(sample.specific_force) {
            spread.add(force.0, force.0 as f32 / SpecificForce::PER_METRE_PER_SEC2);
        }
        if !sample.validity.is_good() {
            self.restart();
        } else if count == RATE_HZ {
            self.judge();
        }
        self.run >= self.seconds
    }

    /// Restarts after a gap, because readings before it say nothing about those after it.
    pub fn restart(&mut self) {
        self.block = [Spread::default(); 6];
        self.first = None;
        self.run = 0;
    }

    fn judge(&mut self) {
        let block = core::mem::take(&mut self.block);
        let per_unit = |axis: usize| {
            if axis < 3 { AngularRate::PER_RAD_PER_SEC } else { SpecificForce::PER_METRE_PER_SEC2 }
        };
        let means: Axes = core::array::from_fn(|axis| block[axis].mean_code() as f32 / per_unit(axis));
        let calm = (0..6).all(|axis| block[axis].std() <= self.std[axis]);
        let first = *self.first.get_or_insert(means);
        let steady = (0..6).all(|axis| libm::fabsf(means[axis] - first[axis]) <= self.drift[axis]);
        if calm && steady {
            self.run = self.run.saturating_add(1);
        } else {
            // This second may be the first of a new run.
            self.first = calm.then_some(means);
            self.run = u8::from(calm);
        }
    }
}

/// The exact sum and the squared deviations of readings (Welford's method: B. P. Welford, Technometrics 4, 1962).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spread {
    count: u32,
    sum: i64,
    mean: f32,
    squares: f32,
}

impl Spread {
    /// The state without a reading.
    pub const EMPTY: Self = Self { count: 0, sum: 0, mean: 0.0, squares: 0.0 };

    /// Adds a reading, as code and as value.
    pub fn add(&mut self, code: i32, value: f32) {
        self.count += 1;
        self.sum += i64::from(code);
        let delta = value - self.mean;
        self.mean += delta / self.count as f32;
        self.squares += delta * (value - self.mean);
    }

    /// Returns the number of readings.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Returns the mean of the codes, rounded to nearest; zero without readings.
    pub fn mean_code(&self) -> i32 {
        let count = i64::from(self.count.max(1));
        (self.sum + count / 2).div_euclid(count) as i32
    }

    /// Returns the variance of the values.
    pub fn variance(&self) -> f32 {
        self.squares / self.count.max(1) as f32
    }

    /// Returns the standard deviation of the values.
    pub fn std(&self) -> f32 {
        sqrt(self.variance())
    }
}
