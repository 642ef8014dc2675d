//! Finds the bias of a fibre-optic gyro from its readings while the wheels stand. Two sources give the reading at
//! rest:
//!
//! - **Standstills.** A Kalman filter of one state, with the random walk of the part's bias, is fed with means over
//!   two seconds with triangular weights, in which an engine's vibration leaves nearly nothing. Each second is part of
//!   two means, so the noise of one is that of a plain second: the part's angle random walk, or what successive means
//!   show if that is larger.
//! - **Latitude and data sheet.** The gyro reads the Earth's rate and a bias of the size that the data sheet states.
//!   Without a latitude the sigma of this source is 9 deg/h.
//!
//! The weighted mean is subtracted, and its variance reported. A new latitude does not change the first source. A mean
//! counts only if the vehicle also stands in the next second: wheels show late that a car pulls away. One that is off
//! by more than ten sigma was no standstill. A reading also shows that unit and sign are those of the configuration:
//! it is the Earth's rate to a half, or its noise is that of the part.

use super::part::FogErrors;
use crate::bias::earth::EARTH_RATE;
use crate::pipeline::Swing;
use crate::sample::{RATE_HZ, Standstill};
use crate::sqrt::sqrt;
use crate::units::Angle;

const STEPS: i64 = RATE_HZ as i64;
const QUARTER: u32 = RATE_HZ / 4;
/// Largest code of a step, 2,900 deg/s: a second's sums stay within 58 bits.
const LARGEST_CODE: i64 = 1 << 43;
/// Uncertainty of the gyro's reading before it has stood still, rad/s: more than any latitude and bias.
const UNKNOWN: f32 = 1e-2;
/// A standing gyro may differ from the expected reading by this many sigmas.
const GATE: f32 = 10.0;
/// The noise is averaged over at most this many differences of successive means.
const MEMORY: u8 = 64;
/// The square of a difference is limited to this many variances, because a beginning turn is not noise.
const LARGEST: f32 = 9.0;
/// Noise in a gyro's own unit over that of the data sheet, moving and at rest; degrees for radians are 57.
const NOISY: f32 = 8.0;
const OWN_UNIT: f32 = 16.0;
/// Differences by which the noise of a gyro in another unit has grown beyond that.
const SETTLED: u8 = 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RestOutcome {
    /// The mean that ended a second before was used.
    Used,
    /// No mean is complete yet, or the newest one waits for the next second.
    Waits,
    Refused,
}

#[derive(Debug, Clone, Copy)]
struct Estimate {
    mean: f32,
    variance: f32,
}

/// A second of turns: their sum, and their sum with weights that rise from 1 to 2 [`STEPS`] - 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Second {
    steps: u8,
    sum: i64,
    rising: i64,
}

impl Second {
    pub const EMPTY: Self = Self { steps: 0, sum: 0, rising: 0 };

    /// Adds a step, hardly limited: to clip the peaks of an engine's shake would remove a share of the Earth's rate.
    pub fn add(&mut self, turn: Angle) {
        let code = turn.0.clamp(-LARGEST_CODE, LARGEST_CODE);
        self.sum += code;
        self.rising += code * (2 * i64::from(self.steps) + 1);
        self.steps += 1;
    }

    /// Returns the mean rate over this second and the next one, rad/s, with triangular weights.
    pub fn triangle(&self, next: &Self) -> f32 {
        let codes = self.rising + 2 * STEPS * next.sum - next.rising;
        codes as f32 / (2 * STEPS) as f32 / Angle::PER_RAD
    }
}

#[derive(Debug, Clone)]
pub struct RestReading {
    errors: FogErrors,
    /// The Earth's rate about the vertical, rad/s; `None` while no latitude is known.
    earth: Option<f32>,
    /// The reading at rest by the standstills alone.
    measured: Estimate,
    /// Variance of the bias by the data sheet.
    bias_variance: f32,
    second: Second,
    before: Option<Second>,
    waiting: Option<Estimate>,
    last: Option<f32>,
    /// Variance of a mean, by the differences of successive means, and the number of these differences.
    noise: f32,
    differences: u8,
    refused: bool,
    /// The rate by which the newest standstill contradicts the reading, rad/s; 0 once one agrees.
    doubt: f32,
    /// Turn of the standing vehicle in the newest quarters of a second, codes, and the steps for which it stands.
    turned: [i64; 5],
    stood: u32,
    /// The turn to and fro by an engine.
    swing: Swing,
    since_walk: u32,
}

impl RestReading {
    /// Creates a filter before its first step, with the Earth's rate about the vertical, rad/s, where it is known.
    pub const fn new(errors: FogErrors, earth: Option<f32>) -> Self {
        Self {
            errors,
            earth,
            measured: Estimate { mean: 0.0, variance: UNKNOWN * UNKNOWN },
            bias_variance: errors.bias * errors.bias,
            second: Second::EMPTY,
            before: None,
            waiting: None,
            last: None,
            noise: errors.angle_walk * errors.angle_walk,
            differences: 1,
            refused: false,
            doubt: 0.0,
            turned: [0; 5],
            stood: 0,
            swing: Swing::over(4.0),
            since_walk: 0,
        }
    }

    /// Sets the Earth's rate here, rad/s: if the vehicle has `moved` the bias is kept, else the reading at rest.
    pub fn set_earth(&mut self, earth: Option<f32>, moved: bool) {
        if let (Some(before), Some(now), true) = (self.earth, earth, moved) {
            self.measured.mean += now - before;
        }
        self.earth = earth;
    }

    /// Adds a step's turn about the vertical (`None` where it is not known), and the standstill that the wheels show.
    /// Returns the outcome of a second at standstill when one is complete.
    pub fn observe(&mut self, turn: Option<Angle>, standstill: Standstill) -> Option<RestOutcome> {
        self.since_walk += 1;
        if self.since_walk == RATE_HZ {
            self.since_walk = 0;
            let walk = self.errors.bias_walk * self.errors.bias_walk;
            self.measured.variance = (self.measured.variance + walk).min(UNKNOWN * UNKNOWN);
            self.bias_variance += walk;
        }
        if standstill != Standstill::Still {
            self.refused = false;
        }
        let (Some(turn), Standstill::Still) = (turn, standstill) else {
            (self.turned, self.stood) = ([0; 5], 0);
            self.second = Second::EMPTY;
            self.before = None;
            self.waiting = None;
            self.last = None;
            return None;
        };
        self.turn(turn);
        self.second.add(turn);
        (i64::from(self.second.steps) == STEPS).then(|| self.end_second())
    }

    fn turn(&mut self, turn: Angle) {
        if self.stood.is_multiple_of(QUARTER) {
            self.turned.rotate_right(1);
            self.turned[0] = 0;
        }
        self.turned[0] += turn.0.clamp(-LARGEST_CODE, LARGEST_CODE);
        self.swing.add(turn.0 as f32 / Angle::PER_RAD);
        self.stood = self.stood.saturating_add(1);
    }

    /// Returns the rate, rad/s, at which a standing vehicle turns beyond the reading at rest, or the gyro's bias has
    /// changed: of the last second, of the newest two quarters, or the doubt of the newest standstill.
    fn against(&self) -> f32 {
        let current = self.stood.saturating_sub(1) % QUARTER + 1;
        let steps = self.stood.min(RATE_HZ + current);
        let off = |turned: i64, steps: u32| {
            (turned as f32 / Angle::PER_RAD - self.combined().mean * steps as f32 / RATE_HZ as f32).abs()
        };
        let noise = |steps: u32| 5.0 * sqrt(self.noise * steps as f32 / RATE_HZ as f32);
        let second = off(self.turned.iter().sum(), steps) - noise(steps);
        let [newest, before, ..] = self.turned;
        let newest_steps = self.stood.min(QUARTER + current);
        let newest = (off(newest + before, newest_steps) - self.swing.angle() - noise(newest_steps))
            * RATE_HZ as f32
            / newest_steps.max(QUARTER) as f32;
        self.doubt.max(second).max(newest)
    }

    pub fn reading(&self) -> f32 {
        self.combined().mean
    }

    /// Returns the expected error of a second's mean rate, 1 sigma, at this `rate` and `shake`, rad/s.
    pub fn sigma(&self, rate: f32, shake: f32) -> f32 {
        let FogErrors { angle_walk, scale, .. } = self.errors;
        let (scaled, against) = (scale * rate, self.against());
        let own = self.combined().variance + angle_walk * angle_walk;
        sqrt(own + scaled * scaled + shake * shake + against * against)
    }

    pub fn is_measured(&self) -> bool {
        self.measured.variance < UNKNOWN * UNKNOWN / 2.0
    }

    pub fn is_contradicted(&self) -> bool {
        self.refused
    }

    pub fn shows_unit(&self) -> bool {
        let (earth, Estimate { mean, variance }) = (self.earth.unwrap_or(0.0), self.measured);
        let by_earth = 4.0 * sqrt(variance) + (mean - earth).abs() < 0.5 * earth.abs();
        let usual = OWN_UNIT * self.errors.angle_walk;
        let by_noise = self.differences > SETTLED && self.noise <= usual * usual;
        self.is_measured() && (by_earth || by_noise)
    }

    fn combined(&self) -> Estimate {
        let expected = match self.earth {
            Some(earth) => Estimate { mean: earth, variance: self.bias_variance },
            // Any latitude: the Earth's rate about the vertical lies evenly between its limits.
            None => Estimate { mean: 0.0, variance: self.bias_variance + EARTH_RATE * EARTH_RATE / 3.0 },
        };
        let weight = expected.variance / (expected.variance + self.measured.variance);
        Estimate {
            mean: expected.mean + weight * (self.measured.mean - expected.mean),
            variance: weight * self.measured.variance,
        }
    }

    fn end_second(&mut self) -> RestOutcome {
        let second = core::mem::replace(&mut self.second, Second::EMPTY);
        let Some(before) = self.before.replace(second) else { return RestOutcome::Waits };
        let mean = before.triangle(&second);
        if let Some(last) = self.last.replace(mean) {
            let square = ((mean - last) * (mean - last)).min(LARGEST * self.noise);
            self.differences = (self.differences + 1).min(MEMORY);
            let noise = self.noise + (square - self.noise) / f32::from(self.differences);
            // A deck that begins to turn, or ends to, is not noise either.
            let largest = NOISY * self.errors.angle_walk;
            self.noise = if self.refused { noise.min(self.noise.max(largest * largest)) } else { noise };
        }
        let by_part = self.errors.angle_walk * self.errors.angle_walk;
        let seen = Estimate { mean, variance: self.noise.max(by_part) };
        let expected = self.combined();
        self.refused = (mean - expected.mean).abs() > GATE * sqrt(expected.variance + seen.variance);
        if self.refused {
            self.doubt = (mean - expected.mean).abs();
            self.waiting = None;
            return RestOutcome::Refused;
        }
        let Some(before) = self.waiting.replace(seen) else { return RestOutcome::Waits };
        self.doubt = 0.0;
        let Estimate { mean, variance } = self.measured;
        let gain = variance / (variance + before.variance);
        self.measured =
            Estimate { mean: mean + gain * (before.mean - mean), variance: gain * before.variance };
        RestOutcome::Used
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEG_PER_HOUR: f32 = core::f32::consts::PI / 180.0 / 3600.0;

    fn stand(rest: &mut RestReading, reading: f32, seconds: u32) -> Option<RestOutcome> {
        let noise = FogErrors::DSP1760.angle_walk * sqrt(RATE_HZ as f32);
        let mut last = None;
        for step in 0..seconds * RATE_HZ {
            let noise = if step % 2 == 0 { noise } else { -noise };
            let turn = Angle((f64::from(reading + noise) / 100.0 * f64::from(Angle::PER_RAD)) as i64);
            last = rest.observe(Some(turn), Standstill::Still).or(last);
        }
        last
    }

    #[test]
    fn ten_minutes_of_standstill_leave_the_angle_random_walk() {
        let mut rest = RestReading::new(FogErrors::DSP1760, None);
        rest.set_earth(Some(9.0 * DEG_PER_HOUR), false);
        stand(&mut rest, 9.4 * DEG_PER_HOUR, 600);
        assert!((rest.reading() / DEG_PER_HOUR - 9.4).abs() < 0.02, "{}", rest.reading() / DEG_PER_HOUR);
        // 0.012 deg per square root of an hour: 0.03 deg/h after ten minutes.
        let bias = rest.combined().variance.sqrt() / DEG_PER_HOUR;
        assert!((0.02..0.05).contains(&bias), "{bias}");
    }

    #[test]
    fn a_standstill_finds_bias_and_earth_without_a_latitude() {
        let mut rest = RestReading::new(FogErrors::DSP1760, None);
        assert!(rest.sigma(0.0, 0.0) > 8.0 * DEG_PER_HOUR && !rest.is_measured());
        stand(&mut rest, -12.0 * DEG_PER_HOUR, 60);
        assert!((rest.reading() / DEG_PER_HOUR + 12.0).abs() < 0.05, "{}", rest.reading() / DEG_PER_HOUR);
        // A latitude that differs by 0.2 deg/h changes the reading little.
        rest.set_earth(Some(-12.2 * DEG_PER_HOUR), false);
        assert!((rest.reading() / DEG_PER_HOUR + 12.0).abs() < 0.05 && rest.is_measured());
        // Where the Earth's rate has changed, the bias is kept.
        rest.set_earth(Some(-11.2 * DEG_PER_HOUR), true);
        assert!((rest.reading() / DEG_PER_HOUR + 11.0).abs() < 0.05, "{}", rest.reading() / DEG_PER_HOUR);
    }

    #[test]
    fn shaking_takes_nothing_from_the_reading() {
        // In a second: no whole periods, and half a degree a second in whole ones.
        for (reading, rate, hertz, off) in [(2e-6, 3e-4, 13.7, 0.05), (4e-5, 0.021, 10.0, 0.01)] {
            let mut rest = RestReading::new(FogErrors::DSP1760, None);
            for step in 0..300 * RATE_HZ {
                let shake = rate * libm::sin(f64::from(step) * 0.01 * hertz * core::f64::consts::TAU);
                let turn = (f64::from(reading) + shake) * 0.01 * f64::from(Angle::PER_RAD);
                rest.observe(Some(Angle(turn as i64)), Standstill::Still);
            }
            let mean = rest.measured.mean;
            assert!((mean - reading).abs() < off * DEG_PER_HOUR, "{}", mean / DEG_PER_HOUR);
            assert!(!rest.is_contradicted());
        }
    }
}
