//! The bias of a reading: what earlier drives have shown at the sensor's temperature, and what a mean at rest shows.
//!
//! The first is subtracted before any other stage, so that the rate can be used before the vehicle has stood. A mean
//! at rest contains the Earth's rate, once: [`ZeroPoint`] holds both.

use super::PipelineConfig;
use crate::bias::EarthRate;
use crate::mounting::{Rotation, VerticalEstimator, is_moved};
use crate::sample::{ImuSample, RATE_HZ};
use crate::units::{AngularRate, SpecificForce};

/// A sensor counts as moved after this many seconds that suggest it: no braking is so hard for so long.
const MOVED_SECONDS: u32 = 4;
/// Part of its error by which the temperature in use changes each second: a wrong reading has little effect.
const SMOOTHING: f32 = 0.125;

#[derive(Debug, Clone, Copy)]
pub(super) struct SensorBias {
    celsius: Option<f32>,
    wait: u32,
    /// The bias there and its sigma, rad/s.
    newest: Option<([AngularRate; 3], f32)>,
    /// The bias of static initialisation, where the first temperature was reported after it.
    found: [AngularRate; 3],
    /// Temperature at which standstills or courses have shown the rest, deg C, and the sigma of its change since, rad/s.
    reference: Option<f32>,
    /// Sigma of the change of bias with temperature since the last [`SensorBias::refer`], rad/s; 0 without a temperature.
    pub(super) change_sigma: f32,
    /// Results of earlier drives: the rotation beyond the mounting, and the force at rest, in the sensor's axes.
    early: Option<(Rotation, [SpecificForce; 3])>,
    /// Specific force of this second, codes, and its good samples.
    force: ([i64; 3], i64),
    /// True if it was not moved since, by the last seconds; and the seconds in a row that say it was.
    in_place: bool,
    elsewhere: u32,
}

impl SensorBias {
    pub(super) const START: Self = Self {
        celsius: None,
        wait: 0,
        newest: None,
        found: [AngularRate::ZERO; 3],
        reference: None,
        change_sigma: 0.0,
        early: None,
        force: ([0; 3], 0),
        in_place: false,
        elsewhere: 0,
    };

    /// Subtracts the learnt bias, in the sensor's axes; returns whether it is the first reading so changed, which
    /// static initialisation must not mix with those before.
    pub(super) fn subtract(
        &mut self,
        sample: &mut ImuSample,
        config: &PipelineConfig,
        initialised: bool,
    ) -> bool {
        let before = self.newest.is_some();
        if self.wait == 0 {
            self.wait = RATE_HZ;
            self.end_second();
            self.take_temperature(sample, config);
        }
        self.wait -= 1;
        if sample.validity.is_good() {
            let (sums, count) = &mut self.force;
            sums.iter_mut().zip(sample.specific_force).for_each(|(sum, axis)| *sum += i64::from(axis.0));
            *count += 1;
        }
        let Some((gyro_bias, _)) = self.newest else { return false };
        if !before && initialised {
            self.found = gyro_bias;
        }
        for ((rate, bias), found) in sample.angular_rate.iter_mut().zip(gyro_bias).zip(self.found) {
            *rate = AngularRate(rate.0.saturating_sub(bias.0.saturating_sub(found.0)));
        }
        !before
    }

    pub(super) fn is_known(&self) -> bool {
        self.newest.is_some()
    }

    pub(super) fn sigma(&self) -> Option<f32> {
        self.newest.map(|(_, sigma)| sigma)
    }

    /// Compares a second's force with that of earlier drives: a single sample shows bumps and braking, too.
    fn end_second(&mut self) {
        let (sums, count) = core::mem::take(&mut self.force);
        let Some((_, before)) = self.early.filter(|_| count > 0) else { return };
        let mean = sums.map(|sum| SpecificForce((sum / count) as i32));
        if is_moved(&before, &mean) {
            self.elsewhere = self.elsewhere.saturating_add(1);
        } else {
            self.elsewhere = 0;
        }
        self.in_place = self.elsewhere == 0 || self.in_place && self.elsewhere < MOVED_SECONDS;
    }

    fn take_temperature(&mut self, sample: &ImuSample, config: &PipelineConfig) {
        let Some(measured) = sample.temperature.filter(|_| sample.validity.is_good()) else { return };
        let measured = f32::from(measured.0) / 100.0;
        let before = self.celsius.unwrap_or(measured);
        let now = before + SMOOTHING * (measured - before);
        self.celsius = Some(now);
        self.newest = config.thermal_bias.at(now);
        let reference = *self.reference.get_or_insert(now);
        self.change_sigma = config.thermal_bias.change_sigma(reference, now);
        if self.early.is_none() {
            self.early = config.rest_force.map(|force| (levelling(config), force));
        }
    }

    pub(super) fn refer(&mut self) {
        self.reference = self.celsius;
        self.change_sigma = 0.0;
    }

    /// Returns levelling and sigma of the bias, rad/s, before static initialisation; `None` without a bias, in the
    /// first second, for a sensor that was moved, and for a bad reading.
    pub(super) fn early(&self, sample: &ImuSample) -> Option<(Rotation, f32)> {
        let (levelling, _) = self.early?;
        let (_, sigma) = self.newest?;
        (self.in_place && sample.validity.is_good()).then_some((levelling, sigma))
    }
}

/// Returns the levelling by what earlier drives have shown.
fn levelling(config: &PipelineConfig) -> Rotation {
    let known = config.vertical.turned(&config.mounting);
    let judged = VerticalEstimator::new(known).judge();
    judged.up.filter(|_| config.levelling).map_or(Rotation::IDENTITY, |up| Rotation::upright(&up))
}

/// The reading at rest of a gyro whose z axis is vertical.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ZeroPoint {
    /// With [`EarthRate::LeftInBias`] it contains the Earth's rate.
    pub(super) bias: [AngularRate; 3],
    earth: AngularRate,
}

impl ZeroPoint {
    /// Creates the zero point from the mean at rest, which contains the Earth's rate.
    pub(super) fn at_rest([x, y, z]: [AngularRate; 3], earth: EarthRate) -> Self {
        let earth = earth.vertical();
        Self { bias: [x, y, AngularRate(z.0.saturating_sub(earth.0))], earth }
    }

    fn reading(&self) -> [AngularRate; 3] {
        let [x, y, z] = self.bias;
        [x, y, AngularRate(z.0.saturating_add(self.earth.0))]
    }

    pub(super) fn less(&self, rates: [AngularRate; 3]) -> [AngularRate; 3] {
        let rest = self.reading();
        core::array::from_fn(|axis| AngularRate(rates[axis].0.saturating_sub(rest[axis].0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bias::Latitude;

    #[test]
    fn a_mean_at_rest_is_the_reading_whatever_is_subtracted() {
        let at_37 = EarthRate::Subtracted(Latitude::from_degrees(37.0).unwrap());
        let mean = [AngularRate(1), AngularRate(-2), AngularRate(50_000)];
        for earth in [EarthRate::LeftInBias, at_37] {
            assert_eq!(ZeroPoint::at_rest(mean, earth).reading(), mean);
        }
        let [_, _, z] = ZeroPoint::at_rest(mean, at_37).bias;
        assert_eq!(z.0, 50_000 - at_37.vertical().0);
        assert_eq!(ZeroPoint::at_rest(mean, EarthRate::LeftInBias).bias, mean);
    }
}
