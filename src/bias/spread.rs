//! Computes mean and spread of a run of readings in one pass, so that no reading is kept.

use crate::sqrt::sqrt;

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
