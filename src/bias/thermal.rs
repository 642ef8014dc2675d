//! The gyro's bias by temperature, as standstills of earlier drives have shown it: a bias and a slope of each axis.
//!
//! It is subtracted from each reading, in the sensor's own axes, so that later stages see a sensor with less bias:
//! before the first standstill, and while the sensor warms up on a drive without one. A Kalman filter learns both with
//! an offset that one start has at all temperatures. The axes share a covariance: they are always measured together.
//! The curvature of real parts is part of each sigma.

use crate::sqrt::sqrt;
use crate::units::{AngularRate, CentiCelsius};
use crate::vector::dot;

/// States of an axis: the bias at 25 deg C, rad/s; its slope, rad/s per kelvin; the offset of the newest start, rad/s.
const STATES: usize = 3;
const OFFSET: usize = 2;
const MIDDLE: f32 = 25.0;
/// Sigma of an unknown part: a bias of 0.5 deg/s; 0.005 deg/s per kelvin (ICM-42688-P, data sheet DS-000347, table 1).
const UNKNOWN: [f32; OFFSET] = [8.7e-3, 8.7e-5];
/// Sigma of the slope elsewhere, because parts bend, rad/s per kelvin: a third, which no data sheet states.
const BENT: f32 = 3e-5;
/// Sigma of the change from one start to the next, because parts age.
const AGEING: [f32; OFFSET] = [5e-5, 8e-7];
/// Sigma of a start's offset before starts have been compared, rad/s: 0.03 deg/s.
const FIRST_OFFSET: f32 = 5e-4;
/// Sigma of a mean over 3 s at rest, rad/s: four of one standstill are as good as one with its offset.
const REST: f32 = 4e-4;
/// The number of starts after which the offsets of old ones are forgotten.
const MEMORY: u8 = 8;
/// Largest plausible value, rad/s.
const LARGEST: f32 = 1.0;
/// Parts are made for these temperatures, deg C; the bias of others is that of the nearest.
const TEMPERATURES: [f32; 2] = [-45.0, 110.0];

#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ThermalBias {
    states: [[f32; STATES]; 3],
    covariance: [[f32; STATES]; STATES],
    /// Mean square of the offsets of starts, (rad/s)^2.
    offset_square: f32,
    starts: u8,
}

impl ThermalBias {
    /// An unknown part: no bias, and the sigma of such parts.
    pub const UNKNOWN: Self = {
        let [bias, slope] = UNKNOWN;
        let covariance = [[bias * bias, 0.0, 0.0], [0.0, slope * slope, 0.0], [0.0; STATES]];
        let offset_square = FIRST_OFFSET * FIRST_OFFSET;
        Self { states: [[0.0; STATES]; 3], covariance, offset_square, starts: 0 }
    };

    /// Returns the bias at a temperature, deg C, and its sigma at a start, rad/s; `None` before a standstill.
    pub fn at(&self, celsius: f32) -> Option<([AngularRate; 3], f32)> {
        if self.starts == 0 {
            return None;
        }
        let by = [1.0, warmer(celsius), 0.0];
        let bent = BENT * (warmer(celsius) - self.best());
        let variance = dot(&self.spread(&by), &by).max(0.0) + self.offset_square + bent * bent;
        Some((self.states.map(|states| code(dot(&states, &by))), sqrt(variance)))
    }

    /// Returns the sigma of the bias' change between two temperatures beyond the slope's share, rad/s.
    pub fn change_sigma(&self, from: f32, to: f32) -> f32 {
        libm::fabsf(warmer(to) - warmer(from)) * sqrt(self.covariance[1][1].max(0.0) + BENT * BENT)
    }

    /// Adds the mean reading of three seconds at rest; `is_first` of those of a start.
    pub fn add(&mut self, is_first: bool, temperature: CentiCelsius, angular_rate: [AngularRate; 3]) {
        let begins = is_first || self.starts == 0;
        if begins {
            self.begin();
        }
        let by = [1.0, warmer(f32::from(temperature.0) / 100.0), 1.0];
        let spread = self.spread(&by);
        let variance = dot(&spread, &by) + REST * REST;
        let mut square = 0.0;
        for (states, rate) in self.states.iter_mut().zip(angular_rate) {
            let off = rate.0 as f32 / AngularRate::PER_RAD_PER_SEC - dot(states, &by);
            square += off * off / 3.0;
            states.iter_mut().zip(spread).for_each(|(state, spread)| *state += spread / variance * off);
        }
        if begins {
            // The expected square of the offset, given the difference, to which line and mean contribute, too. The
            // first start shows the bias, the others how far a start is from it.
            let gain = self.covariance[OFFSET][OFFSET] / variance;
            let expected = gain * gain * square + self.covariance[OFFSET][OFFSET] * (1.0 - gain);
            if self.starts > 0 {
                self.offset_square += (expected - self.offset_square) / f32::from(self.starts + 1);
            }
            self.starts = (self.starts + 1).min(MEMORY);
        }
        for (k, (row, left)) in self.covariance.iter_mut().zip(spread).enumerate() {
            row.iter_mut().zip(spread).for_each(|(value, right)| *value -= left * right / variance);
            row[k] = row[k].max(0.0);
        }
    }

    pub fn is_plausible(&self) -> bool {
        let small = |value: &f32| libm::fabsf(*value) <= LARGEST;
        self.states.as_flattened().iter().chain(self.covariance.as_flattened()).all(small)
            && (0..STATES).all(|k| self.covariance[k][k] >= 0.0)
            && (0.0..=LARGEST).contains(&self.offset_square)
            && self.starts <= MEMORY
    }

    fn begin(&mut self) {
        for ((k, ageing), unknown) in AGEING.into_iter().enumerate().zip(UNKNOWN) {
            self.covariance[k][k] = (self.covariance[k][k] + ageing * ageing).min(unknown * unknown);
            (self.covariance[k][OFFSET], self.covariance[OFFSET][k]) = (0.0, 0.0);
        }
        self.covariance[OFFSET][OFFSET] = self.offset_square;
        self.states.iter_mut().for_each(|states| states[OFFSET] = 0.0);
    }

    fn spread(&self, by: &[f32; STATES]) -> [f32; STATES] {
        self.covariance.map(|row| dot(&row, by))
    }

    /// Where the bias is known best, K from 25 deg C: among the temperatures of the standstills.
    fn best(&self) -> f32 {
        let [_, [with_bias, square, _], _] = self.covariance;
        if square > 0.0 { -with_bias / square } else { 0.0 }
    }
}

fn warmer(celsius: f32) -> f32 {
    let [low, high] = TEMPERATURES;
    celsius.max(low).min(high) - MIDDLE
}

fn code(rad_per_sec: f32) -> AngularRate {
    // Beyond the code's range the cast saturates.
    AngularRate(libm::roundf(rad_per_sec * AngularRate::PER_RAD_PER_SEC) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.005 deg/s per kelvin.
    const SLOPE: f32 = 8.7e-5;

    fn yaw(learned: &ThermalBias, celsius: f32) -> f32 {
        learned.at(celsius).unwrap().0[2].rad_per_sec() as f32
    }

    /// What starts have shown that warm up from some temperature by 15 K, each with an offset about z.
    fn learned(starts: &[(f32, f32)], bias: impl Fn(f32) -> f32) -> ThermalBias {
        let mut learned = ThermalBias::UNKNOWN;
        for (cold, offset) in starts {
            for step in 0..30 {
                let celsius = cold + step as f32 * 0.5;
                let rates = [0.0, 0.001, bias(celsius) + offset];
                let rates = rates.map(|rate| AngularRate::from_rad_per_sec(rate).unwrap());
                learned.add(step == 0, CentiCelsius((100.0 * celsius) as i16), rates);
            }
        }
        learned
    }

    #[test]
    fn an_unknown_part_has_no_bias_and_the_sigma_of_its_kind() {
        assert_eq!(ThermalBias::UNKNOWN.at(20.0), None);
        let sigma = ThermalBias::UNKNOWN.change_sigma(20.0, 30.0);
        assert!((10.0 * SLOPE..15.0 * SLOPE).contains(&sigma), "{sigma}");
        assert_eq!(ThermalBias::UNKNOWN.change_sigma(20.0, 20.0), 0.0);
        assert!(ThermalBias::UNKNOWN.is_plausible());
    }

    #[test]
    fn one_start_shows_the_bias_where_it_was_and_little_of_it_elsewhere() {
        let learned = learned(&[(20.0, 0.0)], |celsius| 0.005 + SLOPE * (celsius - 25.0));
        for celsius in [20.0, 27.0, 34.0] {
            let expected = 0.005 + SLOPE * (celsius - 25.0);
            assert!(
                (yaw(&learned, celsius) - expected).abs() < 3e-4,
                "{celsius}: {}",
                yaw(&learned, celsius)
            );
        }
        let sigma = |celsius| learned.at(celsius).unwrap().1;
        assert!(sigma(-20.0) > 2.0 * sigma(27.0) && sigma(27.0) < 1.2e-3, "{} {}", sigma(-20.0), sigma(27.0));
    }

    #[test]
    fn offsets_of_starts_change_the_sigma_and_not_the_slope() {
        let days: Vec<(f32, f32)> =
            (0..40).map(|day| (5.0 * (day % 5) as f32, [2e-3, -2e-3][day % 2])).collect();
        let learned = learned(&days, |celsius| 0.005 + SLOPE * (celsius - 25.0));
        let change = yaw(&learned, 30.0) - yaw(&learned, 10.0);
        assert!((change - 20.0 * SLOPE).abs() < 1e-4, "{change}");
        assert!((yaw(&learned, 20.0) - 0.0046).abs() < 6e-4, "{}", yaw(&learned, 20.0));
        // One axis of three has the offset.
        let sigma = learned.at(20.0).unwrap().1;
        assert!((0.8e-3..2e-3).contains(&sigma), "{sigma}");
        assert!(learned.change_sigma(10.0, 30.0) < 7e-4, "{}", learned.change_sigma(10.0, 30.0));
        assert!(learned.is_plausible());
    }

    #[test]
    fn the_first_cold_start_is_no_offset() {
        // Three times the slope that parts have, about all axes.
        let mut learned = ThermalBias::UNKNOWN;
        for celsius in [25.0f32, -10.0] {
            let rate = AngularRate::from_rad_per_sec(3.0 * SLOPE * (celsius - 25.0)).unwrap();
            (0..10).for_each(|k| learned.add(k == 0, CentiCelsius((100.0 * celsius) as i16), [rate; 3]));
        }
        let ratio = learned.offset_square / (FIRST_OFFSET * FIRST_OFFSET);
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
    }

    /// The part bends by 0.035 deg/s over 30 K.
    #[test]
    fn what_a_part_bends_by_is_in_the_sigma() {
        let bias = |celsius: f32| 0.002 + SLOPE * (celsius - 25.0) - 7e-7 * (celsius - 25.0).powi(2);
        let days: Vec<(f32, f32)> = (0..20).map(|day| (-20.0 + 5.0 * (day % 10) as f32, 0.0)).collect();
        let learned = learned(&days, bias);
        for celsius in [-40.0, -20.0, 0.0, 20.0, 35.0, 60.0] {
            let (off, sigma) = (yaw(&learned, celsius) - bias(celsius), learned.at(celsius).unwrap().1);
            assert!(off.abs() < 2.0 * sigma, "{celsius}: {off} {sigma}");
            let off = yaw(&learned, celsius) - yaw(&learned, 20.0) - (bias(celsius) - bias(20.0));
            let sigma = learned.change_sigma(20.0, celsius);
            assert!(off.abs() <= 2.0 * sigma, "{celsius}: a change of {off} {sigma}");
        }
    }

    /// A bend adds nothing where standstills have shown the bias, and 0.75 mrad/s at 25 K from there.
    #[test]
    fn a_bend_counts_from_where_the_bias_is_known_best() {
        for cold in [-20.0, 50.0] {
            let learned = learned(&[(cold, 0.0)], |_| 0.001);
            let [at, beside] = [cold + 7.5, cold + 32.5].map(|celsius| learned.at(celsius).unwrap().1);
            assert!(at < 8e-4 && (1e-3..1.5e-3).contains(&beside), "{cold}: {at} {beside}");
        }
    }

    #[test]
    fn what_no_part_is_made_for_is_bounded_or_refused() {
        let learned = learned(&[(20.0, 0.0)], |_| 0.001);
        assert_eq!(learned.at(110.0), learned.at(f32::INFINITY));
        assert_eq!(learned.at(-45.0), learned.at(-1e9));
        let wild = [
            ThermalBias { starts: 9, ..learned },
            ThermalBias { offset_square: f32::NAN, ..learned },
            ThermalBias { states: [[1.1; STATES]; 3], ..learned },
        ];
        assert!(wild.iter().all(|wild| !wild.is_plausible()));
    }
}
