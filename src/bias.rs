//! Estimators of the gyro's reading at rest, and the uncertainty of that estimate.
//!
//! `static_init` takes the mean of three seconds. `zero_rate` estimates, whenever the vehicle stands, the rate that
//! remains after the network. `thermal` keeps the bias by temperature. `earth` keeps the Earth's rotation from being
//! subtracted twice.

pub(crate) mod earth;
mod static_init;
mod thermal;
mod zero_rate;

pub use earth::{EarthRate, Latitude};
pub use static_init::{Rest, STATIC_SAMPLES, StaticConfig, StaticError, StaticInit};
pub use thermal::ThermalBias;
pub use zero_rate::{ZeroRate, ZeroRateConfig, ZeroRateOutcome};

use crate::sqrt::sqrt;

/// The exact sum and the squared deviations of readings (Welford's method: B. P. Welford, Technometrics 4, 1962).
#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    count: u32,
    sum: i64,
    mean: f32,
    squares: f32,
}

impl Spread {
    pub const EMPTY: Self = Self { count: 0, sum: 0, mean: 0.0, squares: 0.0 };

    pub fn add(&mut self, code: i32, value: f32) {
        self.count += 1;
        self.sum += i64::from(code);
        let delta = value - self.mean;
        self.mean += delta / self.count as f32;
        self.squares += delta * (value - self.mean);
    }

    /// Returns the mean of the codes, rounded to nearest; zero without readings.
    pub fn mean_code(&self) -> i32 {
        let count = i64::from(self.count.max(1));
        (self.sum + count / 2).div_euclid(count) as i32
    }

    pub fn variance(&self) -> f32 {
        self.squares / self.count.max(1) as f32
    }

    pub fn std(&self) -> f32 {
        sqrt(self.variance())
    }
}
