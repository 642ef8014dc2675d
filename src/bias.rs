//! Static initialisation: the gyro's bias as its mean over the first three seconds.
//!
//! A vehicle with its engine running shakes but goes nowhere, so stillness is judged twice:
//! the spread inside the three seconds must stay below what an engine does, and the means of
//! its three single seconds must agree, which they do not when the vehicle turns, rolls or
//! speeds up. A steady straight drive can still look like standing; where wheel speeds are
//! known they decide.

use crate::sample::{ImuSample, RATE_HZ};
use crate::units::{AngularRate, SpecificForce};
use serde::{Deserialize, Serialize};

/// Samples of the static initialisation: 3 s.
pub const STATIC_SAMPLES: u32 = 3 * RATE_HZ;
const SECONDS: usize = (STATIC_SAMPLES / RATE_HZ) as usize;

/// Limits of stillness. The test `still_stretches` holds the defaults against eight real drives:
/// none of 656 (overlapping) stretches with standing wheels and a running engine is refused, and
/// 3,177 of 3,247 driven ones are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StaticConfig {
    /// Standard deviation of each gyro axis, rad/s.
    pub gyro_std: f32,
    /// Standard deviation of each accelerometer axis, m/s^2.
    pub accel_std: f32,
    /// Spread of the one-second means of each gyro axis, rad/s.
    pub gyro_drift: f32,
    /// Spread of the one-second means of each accelerometer axis, m/s^2.
    pub accel_drift: f32,
    /// Largest believable bias of a gyro axis, rad/s.
    pub gyro_bias: f32,
}

impl StaticConfig {
    /// Limits for a MEMS part on a car.
    pub const DEFAULT: Self =
        Self { gyro_std: 0.05, accel_std: 1.5, gyro_drift: 0.004, accel_drift: 0.12, gyro_bias: 0.0873 };
}

/// What gave the vehicle's motion away; `axis` is 0, 1, 2 for x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StaticError {
    /// Gyro too restless, rad/s.
    GyroNoise {
        /// The axis.
        axis: u8,
        /// Its standard deviation.
        std: f32,
    },
    /// Accelerometer too restless, m/s^2.
    AccelNoise {
        /// The axis.
        axis: u8,
        /// Its standard deviation.
        std: f32,
    },
    /// The gyro's mean changed from one second to another, rad/s.
    GyroDrift {
        /// The axis.
        axis: u8,
        /// Largest less smallest one-second mean.
        spread: f32,
    },
    /// The accelerometer's mean changed from one second to another, m/s^2.
    AccelDrift {
        /// The axis.
        axis: u8,
        /// Largest less smallest one-second mean.
        spread: f32,
    },
    /// The mean is more than any bias: a steady turn, rad/s.
    GyroBias {
        /// The axis.
        axis: u8,
        /// Its mean.
        mean: f32,
    },
    /// The wheels turn.
    Wheels,
}

impl core::fmt::Display for StaticError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let name = |axis: u8| ["x", "y", "z"].get(usize::from(axis)).copied().unwrap_or("?");
        f.write_str("the vehicle moves during static initialisation: ")?;
        match *self {
            Self::GyroNoise { axis, std } => write!(f, "gyro {} has a spread of {std:.4} rad/s", name(axis)),
            Self::AccelNoise { axis, std } => {
                write!(f, "accelerometer {} has a spread of {std:.3} m/s^2", name(axis))
            }
            Self::GyroDrift { axis, spread } => {
                write!(f, "gyro {} changes its mean by {spread:.4} rad/s", name(axis))
            }
            Self::AccelDrift { axis, spread } => {
                write!(f, "accelerometer {} changes its mean by {spread:.3} m/s^2", name(axis))
            }
            Self::GyroBias { axis, mean } => {
                write!(f, "gyro {} shows a steady {mean:.4} rad/s", name(axis))
            }
            Self::Wheels => f.write_str("the wheels turn"),
        }
    }
}

impl core::error::Error for StaticError {}

/// Sums of one axis.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    /// Of each second, in codes: exact.
    sums: [i64; SECONDS],
    /// Running mean and sum of squared deviations (Welford), in units.
    mean: f32,
    squares: f32,
}

impl Axis {
    fn push(&mut self, n: u32, code: i32, value: f32) {
        self.sums[(n / RATE_HZ) as usize % SECONDS] += i64::from(code);
        let delta = value - self.mean;
        self.mean += delta / (n + 1) as f32;
        self.squares += delta * (value - self.mean);
    }

    fn std(&self) -> f32 {
        libm::sqrtf(self.squares / STATIC_SAMPLES as f32)
    }

    /// Largest less smallest one-second mean, in units.
    fn drift(&self, per_unit: f32) -> f32 {
        let largest = self.sums.iter().max().copied().unwrap_or(0);
        let smallest = self.sums.iter().min().copied().unwrap_or(0);
        (largest - smallest) as f32 / RATE_HZ as f32 / per_unit
    }

    /// Mean over all seconds, rounded to nearest.
    fn mean_code(&self) -> i32 {
        let total: i64 = self.sums.iter().sum();
        (total + i64::from(STATIC_SAMPLES / 2)).div_euclid(i64::from(STATIC_SAMPLES)) as i32
    }
}

/// Static initialisation under way.
#[derive(Debug, Clone)]
pub struct StaticInit {
    config: StaticConfig,
    gyro: [Axis; 3],
    accel: [Axis; 3],
    count: u32,
    /// Turning wheels have been refused, and no sample has been taken since.
    wheels_refused: bool,
}

impl StaticInit {
    /// Starts collecting.
    #[must_use]
    pub fn new(config: StaticConfig) -> Self {
        Self {
            config,
            gyro: [Axis::default(); 3],
            accel: [Axis::default(); 3],
            count: 0,
            wheels_refused: false,
        }
    }

    /// Takes a sample; after [`STATIC_SAMPLES`] of them returns the gyro's bias, or why there
    /// is none, and starts anew.
    pub fn process(&mut self, sample: &ImuSample) -> Option<Result<[AngularRate; 3], StaticError>> {
        self.wheels_refused = false;
        for axis in 0..3 {
            let rate = sample.angular_rate[axis].0;
            let force = sample.specific_force[axis].0;
            self.gyro[axis].push(self.count, rate, rate as f32 / AngularRate::PER_RAD_PER_SEC);
            self.accel[axis].push(self.count, force, force as f32 / SpecificForce::PER_METRE_PER_SEC2);
        }
        self.count += 1;
        if self.count < STATIC_SAMPLES {
            return None;
        }
        let result = self.judge();
        *self = Self::new(self.config);
        Some(result)
    }

    /// The wheels turn, whatever the sample looks like: forgets what was collected. Says so once,
    /// not with every sample of a drive.
    pub fn refuse_wheels(&mut self) -> Option<StaticError> {
        let refused = self.wheels_refused;
        *self = Self { wheels_refused: true, ..Self::new(self.config) };
        (!refused).then_some(StaticError::Wheels)
    }

    /// Forgets what was collected.
    pub fn restart(&mut self) {
        *self = Self::new(self.config);
    }

    fn judge(&self) -> Result<[AngularRate; 3], StaticError> {
        for axis in 0..3u8 {
            let (gyro, accel) = (&self.gyro[usize::from(axis)], &self.accel[usize::from(axis)]);
            let std = gyro.std();
            if std > self.config.gyro_std {
                return Err(StaticError::GyroNoise { axis, std });
            }
            let std = accel.std();
            if std > self.config.accel_std {
                return Err(StaticError::AccelNoise { axis, std });
            }
            let spread = gyro.drift(AngularRate::PER_RAD_PER_SEC);
            if spread > self.config.gyro_drift {
                return Err(StaticError::GyroDrift { axis, spread });
            }
            let spread = accel.drift(SpecificForce::PER_METRE_PER_SEC2);
            if spread > self.config.accel_drift {
                return Err(StaticError::AccelDrift { axis, spread });
            }
            let mean = gyro.mean_code() as f32 / AngularRate::PER_RAD_PER_SEC;
            if libm::fabsf(mean) > self.config.gyro_bias {
                return Err(StaticError::GyroBias { axis, mean });
            }
        }
        Ok(core::array::from_fn(|axis| AngularRate(self.gyro[axis].mean_code())))
    }
}
