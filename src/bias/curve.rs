//! The bias curve is the gyro's bias by temperature, as standstills of earlier drives have shown it.
//!
//! The bias of a MEMS gyro changes with its temperature, mostly in the same way at each start. So the bias that
//! standstills have shown is subtracted from each reading, in the sensor's own axes, and later stages see a sensor
//! with less bias: static initialisation and the zero-rate updates find the rest. The curve helps where they cannot:
//! before the first standstill, and while the sensor warms up on a drive without a standstill.
//!
//! The curve is a polynomial of third degree. A Kalman filter learns its coefficients together with an offset that
//! one start has at all temperatures; the offset is not kept for the next start. The three axes share a covariance,
//! because they are always measured together. The covariance gives the sigma at every temperature, even where there
//! was no standstill.

use crate::sqrt::sqrt;
use crate::units::{AngularRate, CentiCelsius};
use crate::vector::dot;

/// Coefficients of an axis, and its states: the coefficients and the offset of this start.
const COEFFICIENTS: usize = 4;
const STATES: usize = COEFFICIENTS + 1;
/// The middle of the curve, deg C, and the distance from it at which the powers are one, K.
const MIDDLE: f32 = 25.0;
const SPAN: f32 = 25.0;
/// Sigma of the coefficients of an unknown part, rad/s: a bias of 0.5 deg/s; a slope of 0.005 deg/s per kelvin
/// (ICM-42688-P, data sheet DS-000347, table 1); for the curvature, which no data sheet states, a fifth and a tenth
/// of the slope.
const UNKNOWN: [f32; COEFFICIENTS] = [8.7e-3, 8.7e-5 * SPAN, 4.4e-4, 2.2e-4];
/// Sigma of the change of the coefficients from one start to the next, because parts age, rad/s.
const AGEING: [f32; COEFFICIENTS] = [5e-5, 2e-5, 1e-5, 1e-5];
/// Sigma of a start's offset before starts have been compared, rad/s: 0.03 deg/s.
const FIRST_OFFSET: f32 = 5e-4;
/// Sigma of a mean over three seconds at rest, rad/s: four of one standstill are as good as one with the offset of a
/// standstill ([`super::ZeroRateConfig::DEFAULT`]).
const REST: f32 = 4e-4;
/// The number of starts after which the offsets of old ones are forgotten.
const MEMORY: u8 = 8;
/// Largest plausible coefficient, rad/s.
const LARGEST: f32 = 1.0;
/// Parts are made for these temperatures, deg C; the curve ends there.
const TEMPERATURES: [f32; 2] = [-45.0, 110.0];

/// Holds the bias as the curve gives it for a temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveBias {
    /// Bias about x, y and z of the sensor.
    pub gyro_bias: [AngularRate; 3],
    /// Sigma of the bias at this start, rad/s.
    pub sigma: f32,
}

/// Holds the gyro's bias by temperature, in the sensor's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BiasCurve {
    /// Coefficients of x, y and z, rad/s, by rising power of (temperature - 25 deg C) / 25 K.
    coefficients: [[f32; COEFFICIENTS]; 3],
    /// Covariance of the coefficients of each axis, (rad/s)^2.
    covariance: [[f32; COEFFICIENTS]; COEFFICIENTS],
    /// Mean square of the offsets of starts, (rad/s)^2.
    offset_square: f32,
    /// The number of starts with a standstill, 8 at most.
    starts: u8,
}

impl BiasCurve {
    /// The curve of an unknown part: no bias, and the sigma of such parts.
    pub const UNKNOWN: Self = {
        let mut covariance = [[0.0; COEFFICIENTS]; COEFFICIENTS];
        let mut k = 0;
        while k < COEFFICIENTS {
            covariance[k][k] = UNKNOWN[k] * UNKNOWN[k];
            k += 1;
        }
        let offset_square = FIRST_OFFSET * FIRST_OFFSET;
        Self { coefficients: [[0.0; COEFFICIENTS]; 3], covariance, offset_square, starts: 0 }
    };

    /// Returns the bias at a temperature, deg C; `None` before the first standstill.
    #[must_use]
    pub fn at(&self, celsius: f32) -> Option<CurveBias> {
        if self.starts == 0 {
            return None;
        }
        let powers = powers(celsius);
        let gyro_bias = self.coefficients.map(|axis| code(dot(&axis, &powers)));
        let variance = quadratic(&self.covariance, &powers) + self.offset_square;
        Some(CurveBias { gyro_bias, sigma: sqrt(variance) })
    }

    /// Returns the sigma of the change of the bias from one temperature to another (deg C) after the curve's own
    /// change is subtracted, rad/s.
    #[must_use]
    pub fn change_sigma(&self, from: f32, to: f32) -> f32 {
        let (from, to) = (powers(from), powers(to));
        let change = core::array::from_fn(|power| to[power] - from[power]);
        sqrt(quadratic(&self.covariance, &change))
    }

    /// Returns whether all values are plausible for a sensor.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let small = |value: &f32| libm::fabsf(*value) <= LARGEST;
        let variances = (0..COEFFICIENTS).all(|k| self.covariance[k][k] >= 0.0);
        self.coefficients.as_flattened().iter().all(small)
            && self.covariance.as_flattened().iter().all(small)
            && variances
            && (0.0..=LARGEST).contains(&self.offset_square)
            && self.starts <= MEMORY
    }
}

/// Learns the curve from the standstills of one start.
#[derive(Debug, Clone)]
pub struct CurveFilter {
    before: BiasCurve,
    states: [[f32; STATES]; 3],
    covariance: [[f32; STATES]; STATES],
    /// Square of the offset as the first standstill shows it, (rad/s)^2.
    first: Option<f32>,
}

impl CurveFilter {
    /// Creates the filter of a start from the curve of earlier starts.
    #[must_use]
    pub fn new(curve: &BiasCurve) -> Self {
        let mut covariance = [[0.0; STATES]; STATES];
        for (row, before) in covariance.iter_mut().zip(&curve.covariance) {
            row[..COEFFICIENTS].copy_from_slice(before);
        }
        for (k, ageing) in AGEING.iter().enumerate() {
            covariance[k][k] = (covariance[k][k] + ageing * ageing).min(UNKNOWN[k] * UNKNOWN[k]);
        }
        covariance[COEFFICIENTS][COEFFICIENTS] = curve.offset_square;
        let states = curve.coefficients.map(|[a, b, c, d]| [a, b, c, d, 0.0]);
        Self { before: *curve, states, covariance, first: None }
    }

    /// Adds the mean reading of three seconds at rest.
    pub fn add(&mut self, temperature: CentiCelsius, angular_rate: [AngularRate; 3]) {
        let [a, b, c, d] = powers(f32::from(temperature.0) / 100.0);
        let by = [a, b, c, d, 1.0];
        let spread: [f32; STATES] = self.covariance.map(|row| dot(&row, &by));
        let variance = dot(&spread, &by) + REST * REST;
        let mut square = 0.0;
        for (states, rate) in self.states.iter_mut().zip(angular_rate) {
            let off = rate.0 as f32 / AngularRate::PER_RAD_PER_SEC - dot(states, &by);
            square += off * off / 3.0;
            for (state, spread) in states.iter_mut().zip(spread) {
                *state += spread / variance * off;
            }
        }
        // The expected square of the offset, given the difference, to which the curve and the mean at rest
        // contribute, too.
        let of_offset = self.covariance[COEFFICIENTS][COEFFICIENTS];
        let gain = of_offset / variance;
        self.first.get_or_insert(gain * gain * square + of_offset * (1.0 - gain));
        for (row, left) in self.covariance.iter_mut().zip(spread) {
            for (value, right) in row.iter_mut().zip(spread) {
                *value -= left * right / variance;
            }
        }
        for (k, row) in self.covariance.iter_mut().enumerate() {
            row[k] = row[k].max(0.0);
        }
    }

    /// Returns the curve, updated with this start.
    #[must_use]
    pub fn curve(&self) -> BiasCurve {
        let Self { before, states, covariance, first } = self;
        let mut offset_square = before.offset_square;
        // The first start shows the bias, the others how far a start is from the curve.
        if let Some(first) = first.filter(|_| before.starts > 0) {
            offset_square += (first - offset_square) / f32::from(before.starts + 1);
        }
        BiasCurve {
            coefficients: states.map(|[a, b, c, d, _]| [a, b, c, d]),
            covariance: core::array::from_fn(|row| core::array::from_fn(|column| covariance[row][column])),
            offset_square,
            starts: (before.starts + u8::from(first.is_some())).min(MEMORY),
        }
    }
}

/// Returns the powers of a temperature, deg C.
fn powers(celsius: f32) -> [f32; COEFFICIENTS] {
    let [low, high] = TEMPERATURES;
    let x = (celsius.max(low).min(high) - MIDDLE) / SPAN;
    [1.0, x, x * x, x * x * x]
}

/// Returns by' C by, the variance of a linear combination.
fn quadratic<const N: usize>(covariance: &[[f32; N]; N], by: &[f32; N]) -> f32 {
    covariance.iter().zip(by).map(|(row, value)| value * dot(row, by)).sum::<f32>().max(0.0)
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

    fn rates(z: f32) -> [AngularRate; 3] {
        [0.0, 0.001, z].map(|rate| AngularRate::from_rad_per_sec(rate).unwrap())
    }

    fn yaw(curve: &BiasCurve, celsius: f32) -> f32 {
        curve.at(celsius).unwrap().gyro_bias[2].rad_per_sec() as f32
    }

    /// The curve after starts that warm up from some temperature by 15 K, each with an offset.
    fn learned(starts: &[(f32, f32)], bias: impl Fn(f32) -> f32) -> BiasCurve {
        let day = |curve: BiasCurve, (cold, offset): &(f32, f32)| {
            let mut filter = CurveFilter::new(&curve);
            for step in 0..30 {
                let celsius = cold + step as f32 * 0.5;
                let temperature = CentiCelsius((100.0 * celsius) as i16);
                filter.add(temperature, rates(bias(celsius) + offset));
            }
            filter.curve()
        };
        starts.iter().fold(BiasCurve::UNKNOWN, day)
    }

    #[test]
    fn an_unknown_part_has_no_bias_and_the_sigma_of_its_kind() {
        assert_eq!(BiasCurve::UNKNOWN.at(20.0), None);
        let sigma = BiasCurve::UNKNOWN.change_sigma(20.0, 30.0);
        assert!((10.0 * SLOPE..15.0 * SLOPE).contains(&sigma), "{sigma}");
        assert_eq!(BiasCurve::UNKNOWN.change_sigma(20.0, 20.0), 0.0);
        assert!(BiasCurve::UNKNOWN.is_plausible());
    }

    #[test]
    fn one_start_shows_the_bias_where_it_was_and_little_of_it_elsewhere() {
        let curve = learned(&[(20.0, 0.0)], |celsius| 0.005 + SLOPE * (celsius - 25.0));
        for celsius in [20.0, 27.0, 34.0] {
            let expected = 0.005 + SLOPE * (celsius - 25.0);
            assert!((yaw(&curve, celsius) - expected).abs() < 3e-4, "{celsius}: {}", yaw(&curve, celsius));
        }
        let sigma = |celsius| curve.at(celsius).unwrap().sigma;
        assert!(sigma(-20.0) > 2.0 * sigma(27.0) && sigma(27.0) < 1.2e-3, "{} {}", sigma(-20.0), sigma(27.0));
    }

    #[test]
    fn offsets_of_starts_change_the_sigma_and_not_the_shape() {
        let days: Vec<(f32, f32)> =
            (0..40).map(|day| (5.0 * (day % 5) as f32, [2e-3, -2e-3][day % 2])).collect();
        let curve = learned(&days, |celsius| 0.005 + SLOPE * (celsius - 25.0));
        let change = yaw(&curve, 30.0) - yaw(&curve, 10.0);
        assert!((change - 20.0 * SLOPE).abs() < 1e-4, "{change}");
        assert!((yaw(&curve, 20.0) - 0.0046).abs() < 6e-4, "{}", yaw(&curve, 20.0));
        // One axis of three has the offset.
        let sigma = curve.at(20.0).unwrap().sigma;
        assert!((0.8e-3..2e-3).contains(&sigma), "{sigma}");
        assert!(curve.change_sigma(10.0, 30.0) < 2e-4, "{}", curve.change_sigma(10.0, 30.0));
        assert!(curve.is_plausible());
    }

    #[test]
    fn the_first_cold_start_is_no_offset() {
        // Three times the slope that parts have, about all axes.
        let bias = |celsius: f32| 3.0 * SLOPE * (celsius - 25.0);
        let mut curve = BiasCurve::UNKNOWN;
        for celsius in [25.0f32, -10.0] {
            let mut filter = CurveFilter::new(&curve);
            let rate = AngularRate::from_rad_per_sec(bias(celsius)).unwrap();
            (0..10).for_each(|_| filter.add(CentiCelsius((100.0 * celsius) as i16), [rate; 3]));
            curve = filter.curve();
        }
        let ratio = curve.offset_square / (FIRST_OFFSET * FIRST_OFFSET);
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_bent_curve_is_learnt() {
        let bias = |celsius: f32| 0.002 + SLOPE * (celsius - 25.0) - 4e-4 * ((celsius - 25.0) / 25.0).powi(2);
        let days: Vec<(f32, f32)> = (0..20).map(|day| (-20.0 + 5.0 * (day % 10) as f32, 0.0)).collect();
        let curve = learned(&days, bias);
        for celsius in [-20.0, 0.0, 20.0, 35.0] {
            assert!((yaw(&curve, celsius) - bias(celsius)).abs() < 2e-4, "{celsius}");
        }
    }

    #[test]
    fn the_curve_ends_where_parts_do() {
        let curve = learned(&[(20.0, 0.0)], |_| 0.001);
        assert_eq!(curve.at(110.0), curve.at(f32::INFINITY));
        assert_eq!(curve.at(-45.0), curve.at(-1e9));
        let wild = BiasCurve { starts: 9, ..curve };
        assert!(!wild.is_plausible());
        let wild = BiasCurve { offset_square: f32::NAN, ..curve };
        assert!(!wild.is_plausible());
    }
}
