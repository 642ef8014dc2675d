//! Static initialisation takes the gyro's bias as its mean over the first three seconds.
//!
//! An engine shakes a vehicle that goes nowhere, so stillness is judged twice: the spread must stay below what an
//! engine does, and the means of the single seconds must agree, which they do not when the vehicle turns, rolls or
//! speeds up. Where the judge of standstill agrees the change may be twice as large (it rocks when its engine starts).
//! Where its means, which leave an engine out, are calm, the spread may be four times as large, and roll and pitch may
//! change twice as much (wind). A ferry or a steady straight can still look like standing: later standstills heal that
//! ([`super::zero_rate`]).

use super::Spread;
use crate::mounting::LevelError;
use crate::sample::{ImuSample, RATE_HZ};
use crate::units::{AngularRate, SpecificForce};

pub const STATIC_SAMPLES: u32 = 3 * RATE_HZ;
const SECONDS: usize = (STATIC_SAMPLES / RATE_HZ) as usize;

/// Limits of stillness.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StaticConfig {
    /// Standard deviation of each gyro axis, rad/s.
    pub gyro_std: f32,
    /// Standard deviation of each accelerometer axis, m/s^2.
    pub accel_std: f32,
    /// Spread of the one-second means of each gyro axis, rad/s.
    pub gyro_drift: f32,
    /// Spread of the one-second means of each accelerometer axis, m/s^2.
    pub accel_drift: f32,
    /// Largest plausible bias of a gyro axis, rad/s.
    pub gyro_bias: f32,
}

impl StaticConfig {
    pub const DEFAULT: Self =
        Self { gyro_std: 0.05, accel_std: 1.5, gyro_drift: 0.004, accel_drift: 0.12, gyro_bias: 0.0873 };
}

/// The sign of motion that was detected; `axis` is 0, 1, 2 for x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum StaticError {
    #[error("the vehicle moves during static initialisation: gyro {} has a spread of {std:.4} rad/s", name(*.axis))]
    GyroNoise { axis: u8, std: f32 },
    #[error(
        "the vehicle moves during static initialisation: accelerometer {} has a spread of {std:.3} m/s^2",
        name(*.axis)
    )]
    AccelNoise { axis: u8, std: f32 },
    #[error("the vehicle moves during static initialisation: gyro {} changes its mean by {spread:.4} rad/s", name(*.axis))]
    GyroDrift { axis: u8, spread: f32 },
    #[error(
        "the vehicle moves during static initialisation: accelerometer {} changes its mean by {spread:.3} m/s^2",
        name(*.axis)
    )]
    AccelDrift { axis: u8, spread: f32 },
    #[error("the vehicle moves during static initialisation: gyro {} shows a steady {mean:.4} rad/s", name(*.axis))]
    GyroBias { axis: u8, mean: f32 },
    #[error("the vehicle moves during static initialisation: the wheels turn")]
    Wheels,
    #[error(transparent)]
    Level(LevelError),
}

fn name(axis: u8) -> &'static str {
    ["x", "y", "z"].get(usize::from(axis)).copied().unwrap_or("?")
}

#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    all: Spread,
    /// Sums of the codes of each second: exact.
    seconds: [i64; SECONDS],
}

impl Axis {
    const EMPTY: Self = Self { all: Spread::EMPTY, seconds: [0; SECONDS] };

    fn add(&mut self, code: i32, value: f32) {
        self.seconds[(self.all.count / RATE_HZ) as usize % SECONDS] += i64::from(code);
        self.all.add(code, value);
    }

    /// Returns the largest less the smallest one-second mean, in units.
    fn drift(&self, per_unit: f32) -> f32 {
        let largest = self.seconds.iter().max().copied().unwrap_or(0);
        let smallest = self.seconds.iter().min().copied().unwrap_or(0);
        (largest - smallest) as f32 / RATE_HZ as f32 / per_unit
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    pub angular_rate: [AngularRate; 3],
    pub specific_force: [SpecificForce; 3],
    /// Spread of the one-second means about z, rad/s.
    pub drift: f32,
}

#[derive(Debug, Clone)]
pub struct StaticInit {
    config: StaticConfig,
    gyro: [Axis; 3],
    accel: [Axis; 3],
    /// Turning wheels have been refused, and no sample has been taken since.
    wheels_refused: bool,
}

impl StaticInit {
    pub const fn new(config: StaticConfig) -> Self {
        Self { config, gyro: [Axis::EMPTY; 3], accel: [Axis::EMPTY; 3], wheels_refused: false }
    }

    /// Adds a sample; the last one says whether the vehicle probably `stands`, and is `calm` but for an engine. After
    /// [`STATIC_SAMPLES`] it returns the readings at rest, or the reason for refusing them, and restarts.
    pub fn add(&mut self, sample: &ImuSample, stands: bool, calm: bool) -> Option<Result<Rest, StaticError>> {
        self.wheels_refused = false;
        for axis in 0..3 {
            let rate = sample.angular_rate[axis].0;
            let force = sample.specific_force[axis].0;
            self.gyro[axis].add(rate, rate as f32 / AngularRate::PER_RAD_PER_SEC);
            self.accel[axis].add(force, force as f32 / SpecificForce::PER_METRE_PER_SEC2);
        }
        let [first, ..] = &self.gyro;
        if first.all.count < STATIC_SAMPLES {
            return None;
        }
        let result = self.judge(stands, calm);
        self.restart();
        Some(result)
    }

    /// Drops the samples because the wheels turn. Returns the error once, not with every sample of a drive.
    pub fn refuse_wheels(&mut self) -> Option<StaticError> {
        let refused = self.wheels_refused;
        self.restart();
        self.wheels_refused = true;
        (!refused).then_some(StaticError::Wheels)
    }

    pub fn restart(&mut self) {
        for axis in self.gyro.iter_mut().chain(&mut self.accel) {
            *axis = Axis::default();
        }
        self.wheels_refused = false;
    }

    fn judge(&self, stands: bool, calm: bool) -> Result<Rest, StaticError> {
        let wide = |allowed: bool, factor: f32| if allowed { factor } else { 1.0 };
        let (speeding, vibration) = (wide(stands || calm, 2.0), wide(calm, 4.0));
        for axis in 0..3u8 {
            // Whoever boards a vehicle, and the wind, rocks it and does not turn it.
            let turning = wide(stands || calm && axis < 2, 2.0);
            let (gyro, accel) = (&self.gyro[usize::from(axis)], &self.accel[usize::from(axis)]);
            let std = gyro.all.std();
            if std > vibration * self.config.gyro_std {
                return Err(StaticError::GyroNoise { axis, std });
            }
            let std = accel.all.std();
            if std > vibration * self.config.accel_std {
                return Err(StaticError::AccelNoise { axis, std });
            }
            let spread = gyro.drift(AngularRate::PER_RAD_PER_SEC);
            if spread > turning * self.config.gyro_drift {
                return Err(StaticError::GyroDrift { axis, spread });
            }
            let spread = accel.drift(SpecificForce::PER_METRE_PER_SEC2);
            if spread > speeding * self.config.accel_drift {
                return Err(StaticError::AccelDrift { axis, spread });
            }
            let mean = gyro.all.mean_code() as f32 / AngularRate::PER_RAD_PER_SEC;
            if libm::fabsf(mean) > self.config.gyro_bias {
                return Err(StaticError::GyroBias { axis, mean });
            }
        }
        let [.., yaw] = &self.gyro;
        Ok(Rest {
            angular_rate: self.gyro.each_ref().map(|axis| AngularRate(axis.all.mean_code())),
            specific_force: self.accel.each_ref().map(|axis| SpecificForce(axis.all.mean_code())),
            drift: yaw.drift(AngularRate::PER_RAD_PER_SEC),
        })
    }
}
