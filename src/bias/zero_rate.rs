//! Zero-rate updates estimate, while the vehicle stands, the error of the yaw rate that the network has not removed.
//!
//! A Kalman filter estimates two states from one-second means of the gyro, less its static bias and its
//! complete correction:
//!
//! - the **bias** b also holds while driving: it is a random walk, and changes with temperature;
//! - the **offset** s holds for one standstill only: an idling engine shakes the sensor differently from
//!   a road, which shifts the mean of gyro and network. The shift differs from stop to stop and does not
//!   average out during a stop: without this state, a minute at a traffic light would make the filter
//!   too certain of a bias that does not hold on the road.
//!
//! The mean of a second is modelled as z = b + s + noise, with the noise taken from the spread of the ten means of
//! [`BATCH`] samples in it: the spread of single samples would not show that an engine's vibration averages out
//! faster than white noise, nor that a low-pass correction makes samples alike. A second counts only if the vehicle
//! also stands in the next one, because wheel sensors show late that a car pulls away.

use super::quiet::Spread;
use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;
use crate::units::AngularRate;

/// Describes the noise of part and vehicle. All values are 1 sigma.
#[derive(Debug, Clone, Copy)]
pub struct ZeroRateConfig {
    /// Bias left by static initialisation, rad/s.
    pub initial: f32,
    /// Random walk of the bias, rad/s per square root of a second.
    pub walk: f32,
    /// Offset of a standstill, rad/s.
    pub standstill: f32,
    /// Least noise of a one-second mean, rad/s: a smaller spread is raised to it.
    pub noise: f32,
    /// A second whose mean is off by more than this, and by more than ten sigma of the bias, is not a standstill,
    /// whatever the wheels report, rad/s.
    pub max_step: f32,
    /// Largest bias, and largest uncertainty of it, rad/s.
    pub max_bias: f32,
}

impl ZeroRateConfig {
    /// The noise of a MEMS part on a car. The walk is the one published for an Xsens MTi-100 (OpenVINS,
    /// `config/kaist`); the noise is less than half of that part's 1.7e-4 rad/s/sqrt(Hz) over a second, so that a
    /// better part benefits. The offset is measured: between standing and driving the mean error of the corrected
    /// rate changes by 1.3e-4 rad/s RMS over the five training drives and the validation drive, 0.9e-4 on the latter
    /// alone.
    pub const DEFAULT: Self =
        Self { initial: 1e-4, walk: 1e-5, standstill: 1.4e-4, noise: 5e-5, max_step: 5e-3, max_bias: 0.02 };
}

/// Samples in each of the means whose spread is taken.
const BATCH: u32 = 10;

/// Low-order bits that are dropped when the turn at standstill is summed.
const TURNED_SHIFT: u32 = AngularRate::FRACTION_BITS - 20;

/// The evidence that the vehicle stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StandstillSource {
    /// There is no evidence.
    #[default]
    None,
    /// All wheels stand. That is enough by itself: a gate on the gyro would exclude a true bias.
    Wheels,
    /// The inertial sensors are quiet. The mean must also be plausible for the bias.
    Inertial,
}

/// Says how a whole second at standstill was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ZeroRateOutcome {
    /// The second before this one was used.
    Used,
    /// The second waits for the next one, because there was none before it.
    Waits,
    /// The gyro contradicts the source: nothing was used.
    Refused,
}

/// Holds the mean of a second and the variance of that mean.
#[derive(Debug, Clone, Copy)]
struct Measurement {
    mean: f32,
    variance: f32,
}

/// Covariance of bias and offset.
#[derive(Debug, Clone, Copy)]
struct Covariance {
    bias: f32,
    both: f32,
    offset: f32,
}

/// Estimates the bias that remains after static initialisation and network.
#[derive(Debug, Clone)]
pub struct ZeroRate {
    config: ZeroRateConfig,
    bias: f32,
    offset: f32,
    covariance: Covariance,
    source: StandstillSource,
    /// The means of a second so far, and the sum and number of the samples of the next one.
    block: Spread,
    batch: (i64, u32),
    waiting: Option<Measurement>,
    refused: bool,
    /// Turn at standstill by the newest samples, 2^-20 rad/s x samples: in the current quarter of a second and in the
    /// four before it. Then the samples left in the current quarter.
    turned: [i32; 5],
    turning_for: u8,
    since_walk: u32,
    /// Sigma of the change of the bias with temperature since the last update, rad/s.
    thermal: f32,
}

impl ZeroRate {
    /// Creates a filter after static initialisation.
    #[must_use]
    pub fn new(config: ZeroRateConfig) -> Self {
        let square = |sigma: f32| sigma * sigma;
        let covariance =
            Covariance { bias: square(config.initial), both: 0.0, offset: square(config.standstill) };
        Self {
            config,
            bias: 0.0,
            offset: 0.0,
            covariance,
            source: StandstillSource::None,
            block: Spread::EMPTY,
            batch: (0, 0),
            waiting: None,
            refused: false,
            turned: [0; 5],
            turning_for: 0,
            since_walk: 0,
            thermal: 0.0,
        }
    }

    /// Adds the remaining rate of a complete sample (gyro less static bias less the network's estimate; `None` where
    /// that is not good). `source` is the evidence that the vehicle stands, and `thermal` the sigma of the change of
    /// the bias with temperature since the last outcome [`ZeroRateOutcome::Used`], rad/s. Returns the outcome of a
    /// second at standstill when one is complete.
    pub fn observe(
        &mut self,
        left: Option<AngularRate>,
        source: StandstillSource,
        thermal: f32,
    ) -> Option<ZeroRateOutcome> {
        self.thermal = thermal;
        self.since_walk += 1;
        if self.since_walk == RATE_HZ {
            self.since_walk = 0;
            self.walk();
        }
        if source != self.source {
            self.stop_begins(source);
        }
        if source == StandstillSource::None {
            return None;
        }
        let Some(AngularRate(left)) = left else {
            // A gap makes the second incomplete, and cancels the pending one.
            self.restart();
            return None;
        };
        let (sum, count) = (self.batch.0 + i64::from(left), self.batch.1 + 1);
        self.batch = (sum, count);
        if count < BATCH {
            return None;
        }
        self.batch = (0, 0);
        let mean = (sum / i64::from(BATCH)) as i32;
        self.block.add(mean, mean as f32 / AngularRate::PER_RAD_PER_SEC);
        if self.block.count() < RATE_HZ / BATCH {
            return None;
        }
        let block = core::mem::take(&mut self.block);
        Some(self.second(&block))
    }

    /// Checks the newest sample's rate, less static bias, before it is complete. Returns true once when the rate
    /// contradicts the wheels.
    ///
    /// A vehicle may slide with its wheels locked. The limit on the turn of a second at standstill therefore also
    /// applies to parts of a second: when a sample exceeds it, that sample's delayed rate, which is zero at
    /// standstill, has not been sent yet.
    pub fn contradicts_wheels(&mut self, rate: AngularRate) -> bool {
        if self.source != StandstillSource::Wheels {
            self.turned = [0; 5];
            return false;
        }
        if self.turning_for == 0 {
            // Any second that ends now lies within the five quarters.
            self.turned.rotate_right(1);
            (self.turned[0], self.turning_for) = (0, RATE_HZ as u8 / 4);
        }
        // A sum of 125 of them fits.
        self.turned[0] += rate.0.saturating_sub(self.bias().0) >> TURNED_SHIFT;
        self.turning_for -= 1;
        let per_rad = (AngularRate::PER_RAD_PER_SEC / (1 << TURNED_SHIFT) as f32) * RATE_HZ as f32;
        let turned = self.turned.iter().sum::<i32>() as f32 / per_rad;
        if libm::fabsf(turned) <= self.wheels_gate() {
            return false;
        }
        self.turned = [0; 5];
        if core::mem::replace(&mut self.refused, true) {
            return false;
        }
        // The next whole second shows whether the turn goes on.
        self.restart();
        true
    }

    /// Returns whether the wheels stand while the gyro shows a turn.
    #[must_use]
    pub fn contradicted(&self) -> bool {
        self.source == StandstillSource::Wheels && self.refused
    }

    /// The evidence that the vehicle stands; none where the gyro contradicts it.
    #[must_use]
    pub fn evidence(&self) -> StandstillSource {
        if self.refused { StandstillSource::None } else { self.source }
    }

    /// Returns the largest turn of a second at standstill, rad.
    fn wheels_gate(&self) -> f32 {
        self.config.max_step.max(10.0 * self.sigma())
    }

    /// Drops the current second, which a gap has cut short.
    pub fn restart(&mut self) {
        self.block = Spread::EMPTY;
        self.batch = (0, 0);
        self.waiting = None;
    }

    /// Returns the bias to subtract; while the vehicle stands, it contains the offset of this standstill.
    #[must_use]
    pub fn bias(&self) -> AngularRate {
        let stands = self.source != StandstillSource::None && !self.refused;
        let bias = if stands { self.bias + self.offset } else { self.bias };
        let bias = within(bias, 2.0 * self.config.max_bias);
        AngularRate(libm::roundf(bias * AngularRate::PER_RAD_PER_SEC) as i32)
    }

    /// Returns the uncertainty of the bias when driving, 1 sigma, rad/s.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        sqrt(self.bias_variance())
    }

    /// Returns the variance of the bias when driving: that of the filter, and that of the change with temperature since
    /// the last update, (rad/s)^2.
    fn bias_variance(&self) -> f32 {
        let largest = self.config.max_bias;
        (self.covariance.bias + self.thermal * self.thermal).min(largest * largest)
    }

    /// Returns whether the wheels stand and the gyro does not contradict them.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.source == StandstillSource::Wheels && !self.refused
    }

    fn stop_begins(&mut self, source: StandstillSource) {
        self.source = source;
        self.refused = false;
        self.restart();
        self.offset = 0.0;
        let offset = self.config.standstill * self.config.standstill;
        self.covariance = Covariance { both: 0.0, offset, ..self.covariance };
    }

    /// Adds a second of the bias' random walk to its variance.
    fn walk(&mut self) {
        let ZeroRateConfig { walk, max_bias, .. } = self.config;
        self.covariance.bias = (self.covariance.bias + walk * walk).min(max_bias * max_bias);
    }

    fn second(&mut self, block: &Spread) -> ZeroRateOutcome {
        let noise = self.config.noise;
        let measured = Measurement {
            mean: block.mean_code() as f32 / AngularRate::PER_RAD_PER_SEC,
            variance: (block.variance() / (block.count() - 1) as f32).max(noise * noise),
        };
        let step = measured.mean - self.bias - self.offset;
        let Covariance { both, offset, .. } = self.covariance;
        let bias = self.bias_variance();
        let gate = match self.source {
            StandstillSource::Wheels => self.wheels_gate(),
            StandstillSource::Inertial => 3.0 * sqrt(bias + 2.0 * both + offset + measured.variance),
            StandstillSource::None => 0.0,
        };
        if libm::fabsf(step) > gate {
            self.waiting = None;
            self.refused = true;
            return ZeroRateOutcome::Refused;
        }
        self.refused = false;
        let Some(before) = self.waiting.replace(measured) else { return ZeroRateOutcome::Waits };
        self.update(before);
        ZeroRateOutcome::Used
    }

    /// Applies the Kalman filter's measurement update.
    fn update(&mut self, measured: Measurement) {
        self.covariance.bias = self.bias_variance();
        self.thermal = 0.0;
        let Covariance { bias, both, offset } = self.covariance;
        let (with_bias, with_offset) = (bias + both, both + offset);
        let innovation = measured.mean - self.bias - self.offset;
        let per_variance = 1.0 / (with_bias + with_offset + measured.variance);
        let (bias_gain, offset_gain) = (with_bias * per_variance, with_offset * per_variance);
        let largest = self.config.max_bias;
        self.bias = within(self.bias + bias_gain * innovation, largest);
        self.offset = within(self.offset + offset_gain * innovation, largest);
        self.covariance = Covariance {
            bias: (bias - bias_gain * with_bias).max(0.0),
            both: both - bias_gain * with_offset,
            offset: (offset - offset_gain * with_offset).max(0.0),
        };
    }
}

/// Bounds a value to +-`largest`. (`clamp` would panic on bounds that a configuration has made NaN.)
fn within(value: f32, largest: f32) -> f32 {
    value.max(-largest).min(largest)
}
