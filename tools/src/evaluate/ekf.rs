//! The filter that a user of a GNSS receiver would write: an extended Kalman filter of heading, bias and gain.
//!
//! It integrates the gyro, and gets what the board gets: every course with its accuracy, the bias of static
//! initialisation once the board has it, and the means of the seconds in which the board's judge of standstill lets the
//! bias be updated. A course counts as the heading some lag ago, is weighed by its accuracy, the speed and the rate, and
//! left out beyond four sigma; after ten seconds without a match the heading starts again.

use super::angle::wrap;
use crate::drive::DT;
use gyronet::heading::{CourseConfig, Heading};

/// Sigma of a course besides its own, rad, and in a turn, rad per rad/s.
const ACCURACY: f64 = 0.02;
const TURNING: f64 = 0.3;
/// Lag of a course behind the heading, s: the board's before it has learnt it.
const LAG: f64 = 0.3;
/// Random walks of bias, rad/s, and of heading, rad, per square root of a second.
const WALKS: [f64; 2] = [2e-5, 3e-4];
/// Sigma of bias and gain before they are known, and of a mean at standstill, rad/s.
const FIRST: [f64; 2] = [0.02, 0.005];
const STANDSTILL: f64 = 3e-4;
/// Least time between two courses, and time without a match before the heading starts again, s.
const APART: f64 = 0.95;
const PATIENCE: f64 = 10.0;
/// Innovation over its sigma beyond which a course is left out.
const GATE: f64 = 4.0;

/// States: bias, gain, heading.
#[derive(Debug, Clone)]
pub struct Filter {
    state: [f64; 3],
    covariance: [[f64; 3]; 3],
    time: f64,
    /// The newest course and the newest that matched, s.
    last: f64,
    matched: Option<f64>,
    rate: f64,
}

impl Default for Filter {
    fn default() -> Self {
        let mut covariance = [[0.0; 3]; 3];
        let [bias, gain] = FIRST;
        (covariance[0][0], covariance[1][1]) = (bias * bias, gain * gain);
        Self { state: [0.0; 3], covariance, time: 0.0, last: f64::NEG_INFINITY, matched: None, rate: 0.0 }
    }
}

impl Filter {
    /// Adds a sample of the gyro, rad/s; returns the rate less bias and gain.
    pub fn sample(&mut self, gyro: f64, stands: bool) -> f64 {
        let [bias, gain, heading] = &mut self.state;
        let driven = gyro - *bias;
        let rate = driven * (1.0 - *gain);
        self.time += DT;
        self.rate += 0.05 * (rate - self.rate);
        self.covariance[0][0] += WALKS[0] * WALKS[0] * DT;
        if !stands {
            *heading += rate * DT;
            let by = [-DT, -driven * DT];
            let add: [f64; 3] = std::array::from_fn(|column| {
                by[0] * self.covariance[0][column] + by[1] * self.covariance[1][column]
            });
            let own = by[0] * add[0] + by[1] * add[1];
            for (state, add) in add.iter().enumerate() {
                self.covariance[2][state] += add;
                self.covariance[state][2] += add;
            }
            self.covariance[2][2] += own + WALKS[1] * WALKS[1] * DT;
        }
        rate
    }

    /// Adds the mean of the gyro over some time at standstill, rad/s.
    pub fn standstill(&mut self, mean: f64) {
        self.update(0, mean - self.state[0], STANDSTILL * STANDSTILL);
    }

    pub fn course(&mut self, from: &Heading) {
        let (Some(course), Some(sigma)) = (from.course, CourseConfig::DEFAULT.sigma(from).map(f64::from))
        else {
            return;
        };
        if self.time - self.last < APART {
            return;
        }
        self.last = self.time;
        let variance = sigma * sigma + ACCURACY * ACCURACY + (TURNING * self.rate).powi(2);
        let heading = wrap(LAG * self.rate - f64::from(course));
        let off = wrap(heading - self.state[2]);
        let is_off = off * off > GATE * GATE * (self.covariance[2][2] + variance);
        match self.matched {
            Some(matched) if is_off && self.time - matched < PATIENCE => return,
            Some(_) if !is_off => self.update(2, off, variance),
            _ => {
                for state in 0..3 {
                    (self.covariance[2][state], self.covariance[state][2]) = (0.0, 0.0);
                }
                (self.state[2], self.covariance[2][2]) = (heading, variance);
            }
        }
        self.matched = Some(self.time);
    }

    fn update(&mut self, measured: usize, innovation: f64, variance: f64) {
        let with = self.covariance[measured];
        let per_variance = 1.0 / (with[measured] + variance);
        for row in 0..3 {
            let gain = with[row] * per_variance;
            self.state[row] += gain * innovation;
            for (cell, with) in self.covariance[row].iter_mut().zip(with) {
                *cell -= gain * with;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_and_gain_are_found_on_a_winding_road() {
        let (mut filter, mut heading) = (Filter::default(), 0.0f64);
        for step in 0..60_000u32 {
            let rate = 0.2 * (f64::from(step) * DT * 0.1).sin();
            heading += rate * DT;
            filter.sample(1.004 * rate + 0.003, false);
            if step % 100 == 0 {
                let course = Some((LAG * rate - heading).rem_euclid(std::f64::consts::TAU) as f32);
                filter.course(&Heading { course, speed: Some(20.0), ..Heading::default() });
            }
        }
        let [bias, gain, _] = filter.state;
        assert!((bias - 0.003).abs() < 5e-5 && (gain - 0.004).abs() < 1e-3, "{bias} {gain}");
    }
}
