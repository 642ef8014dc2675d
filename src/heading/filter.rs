//! The Kalman filter of what a yaw gyro reads wrong, for standstills and courses alike.
//!
//! | state | unit | between measurements |
//! |---|---|---|
//! | [`BIAS`] | rad/s | random walk |
//! | [`STOP`]: offset of a standstill | rad/s | each stop has its own |
//! | [`GAIN`]: share of the rate that is read too much | | constant |
//! | [`HEADING`] of the vehicle | rad, to the left | the gyro's turn less bias and gain |
//! | [`LAG`] of the course behind the heading | s | random walk |
//!
//! A second at standstill measures the sum of the first two. A course measures the heading some lag ago. The lag is the
//! receiver's latency and, because its effect is as proportional to the rate, the slip of the vehicle in a turn.
//!
//! Without a course the last three are independent of the first two, and nothing is computed with them.

use super::Gain;

pub(crate) const BIAS: usize = 0;
pub(crate) const STOP: usize = 1;
pub(crate) const GAIN: usize = 2;
pub(crate) const HEADING: usize = 3;
pub(crate) const LAG: usize = 4;
const STATES: usize = 5;
/// Sigma of the bias with which a rate can be used, and with which it is as good as after a standstill, rad/s.
pub(crate) const COARSE_BIAS: f32 = 2e-3;
pub(crate) const FINE_BIAS: f32 = 5e-4;

type Vector = [f32; STATES];

#[derive(Debug, Clone, Copy)]
pub(crate) struct Measured {
    /// Course less the heading that the filter expects a lag ago, rad.
    pub off: f32,
    pub rate: f32,
    pub variance: f32,
}

#[derive(Debug, Clone)]
pub(crate) struct Filter {
    state: Vector,
    covariance: [Vector; STATES],
}

impl Filter {
    /// Creates a filter with these variances of the bias and the offset of a standstill.
    pub const fn new(bias: f32, stop: f32) -> Self {
        let mut covariance = [[0.0; STATES]; STATES];
        covariance[BIAS][BIAS] = bias;
        covariance[STOP][STOP] = stop;
        Self { state: [0.0; STATES], covariance }
    }

    pub const fn get<const STATE: usize>(&self) -> f32 {
        self.state[STATE]
    }

    /// Sets a state and keeps its covariance.
    pub const fn put<const STATE: usize>(&mut self, value: f32) {
        self.state[STATE] = value;
    }

    pub const fn variance<const STATE: usize>(&self) -> f32 {
        self.covariance[STATE][STATE]
    }

    /// Sets the variance of a state and keeps its covariance with others.
    pub const fn put_variance<const STATE: usize>(&mut self, variance: f32) {
        self.covariance[STATE][STATE] = variance;
    }

    pub const fn bias_and_stop(&self) -> f32 {
        self.covariance[BIAS][STOP]
    }

    /// Starts a state again, independent of all others.
    pub fn restart<const STATE: usize>(&mut self, value: f32, variance: f32) {
        for row in &mut self.covariance {
            row[STATE] = 0.0;
        }
        self.covariance[STATE] = [0.0; STATES];
        self.covariance[STATE][STATE] = variance;
        self.state[STATE] = value;
    }

    /// Starts with the gain that earlier drives have shown.
    pub fn give_back(&mut self, gain: Option<Gain>) {
        if let Some(Gain { share, sigma, .. }) = gain {
            self.restart::<GAIN>(share, sigma * sigma);
        }
    }

    pub fn standstill(&mut self, mean: f32, variance: f32) {
        let [bias, stop, ..] = self.covariance;
        let with = combined(&bias, 1.0, &stop);
        let innovation = mean - self.state[BIAS] - self.state[STOP];
        let per_variance = 1.0 / (with[BIAS] + with[STOP] + variance);
        let gains = with.map(|with| with * per_variance);
        self.apply(&gains, innovation, &with);
    }

    /// Turns the heading by what the gyro shows in some time, rad and s; `stands` is true at a standstill.
    pub fn turn(&mut self, turned: f32, seconds: f32, stands: bool) {
        let at_stop = if stands { seconds } else { 0.0 };
        let driven = turned - self.state[BIAS] * seconds;
        self.state[HEADING] =
            wrap(self.state[HEADING] + driven - self.state[GAIN] * driven - self.state[STOP] * at_stop);
        // The heading's row of the transition; all others are those of the identity.
        let [bias, stop, gain, ..] = self.covariance;
        let add = combined(&combined(&bias, at_stop / seconds, &stop), driven / seconds, &gain)
            .map(|sum| -seconds * sum);
        let own = -seconds * add[BIAS] - at_stop * add[STOP] - driven * add[GAIN];
        for (row, add) in self.covariance.iter_mut().zip(add) {
            row[HEADING] += add;
        }
        for (own, add) in self.covariance[HEADING].iter_mut().zip(add) {
            *own += add;
        }
        self.covariance[HEADING][HEADING] += own;
    }

    /// Returns the variance of the difference between a course and the heading that is expected.
    pub fn innovation(&self, measured: &Measured) -> f32 {
        let with = self.with_course(measured.rate);
        with[HEADING] - measured.rate * with[LAG] + measured.variance
    }

    fn with_course(&self, rate: f32) -> Vector {
        let [.., heading, lag] = self.covariance;
        combined(&heading, -rate, &lag)
    }

    /// Returns the variance of the bias that would be left if the gain were known.
    pub fn bias_beside_gain(&self) -> f32 {
        let ([bias, _, both, ..], gain) = (self.covariance[BIAS], self.variance::<GAIN>());
        if gain > 0.0 { bias - both * both / gain } else { bias }
    }

    /// Adds a course; a `held` bias or gain keeps value and variance, as a known source of error (Schmidt-Kalman). The
    /// heading changes as if the course's variance were divided by `weight`, 0 to 1.
    pub fn course(&mut self, measured: &Measured, held: [bool; 2], weight: f32) {
        let with = self.with_course(measured.rate);
        let variance = with[HEADING] - measured.rate * with[LAG] + measured.variance;
        let mut gains = with.map(|with| with / variance);
        gains[HEADING] *= variance / (variance + (1.0 / weight - 1.0) * measured.variance);
        let [is_bias_held, is_gain_held] = held;
        if is_bias_held {
            gains[BIAS] = 0.0;
        }
        if is_gain_held {
            gains[GAIN] = 0.0;
        }
        self.apply(&gains, measured.off, &with);
        self.state[HEADING] = wrap(self.state[HEADING]);
        // What the gains leave out, in Joseph's form: zero where they are the best ones.
        for ((row, with), gain) in self.covariance.iter_mut().zip(with).zip(gains) {
            let rest = with - gain * variance;
            row.iter_mut().zip(gains).for_each(|(own, gain)| *own -= rest * gain);
        }
    }

    fn apply(&mut self, gains: &Vector, innovation: f32, with: &Vector) {
        for ((state, row), gain) in self.state.iter_mut().zip(&mut self.covariance).zip(gains) {
            *state += gain * innovation;
            row.iter_mut().zip(with).for_each(|(own, with)| *own -= gain * with);
        }
        let [[bias, ..], [_, stop, ..], [_, _, gain, ..], [.., heading, _], [.., lag]] = &mut self.covariance;
        for variance in [bias, stop, gain, heading, lag] {
            *variance = variance.max(0.0);
        }
    }
}

fn combined(one: &Vector, part: f32, other: &Vector) -> Vector {
    let mut sum = *one;
    sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += part * other);
    sum
}

/// Wraps an angle of a few turns to -pi to pi.
pub(crate) fn wrap(angle: f32) -> f32 {
    use core::f32::consts::TAU;
    angle - TAU * libm::roundf(angle / TAU)
}
