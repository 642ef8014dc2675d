//! This module estimates the gyro's bias in motion from the difference of the rear wheels, with a Kalman filter over
//! means of a second. It is compared with the bias curve; the board does not run it.
//!
//! The measurement gyro - difference / track is modelled as bias + r v + k w + l w v^2 + t T + s a v, with speed v,
//! yaw rate w, temperature T and acceleration a. The parameters are the tyres' difference r, which has a rate of
//! change while they warm up, the errors of scale k and of load l, the bias by temperature t, and the difference in
//! slip s. A difference of the tyres of 1e-5 is 0.012 deg/s at 31 m/s: as much as the bias changes in an hour.
//!
//! The filter has an advantage: its noises were tuned on this simulation, and the acceleration uses the next second.
//! If it is no better than the curve here, it is no better anywhere.

use super::drive::TRACK;
use nalgebra::{SMatrix, SVector};

/// Number of states: bias, r, k, l, t, s, and the rate of r.
const STATES: usize = 7;
type Vector = SVector<f64, STATES>;
type Matrix = SMatrix<f64, STATES, STATES>;

/// Sigma of each state before the drive.
const INITIAL: [f64; STATES] = [1e-4, 2e-3, 0.05, 1e-4, 8.7e-5, 1e-3, 1e-6];
/// Sigma of each state's change in a second.
const WALK: [f64; STATES] = [3e-6, 1e-7, 1e-5, 1e-7, 1e-7, 1e-7, 3e-9];
/// Sigma of a second's mean: gyro and wheels (0.01 km/h on the bus), and the gyro alone at standstill, rad/s.
const MOVING: f64 = 6e-4;
const STANDING: f64 = 1.5e-4;
/// Least speed for using the wheels, m/s; below it their resolution is too coarse.
const SLOW: f64 = 5.0;
/// Sigmas beyond which a reading is rejected.
const GATE: f64 = 5.0;

/// The means of one second.
#[derive(Debug, Clone, Copy)]
pub struct Second {
    /// Gyro less its static bias, rad/s.
    pub gyro: f64,
    /// Speeds of the rear wheels, left and right, m/s.
    pub wheels: [f64; 2],
    /// Whether the vehicle stands.
    pub stands: bool,
    /// Temperature above that of the first second, K; 0 if the curve has corrected the gyro.
    pub warmer: f64,
}

/// Returns the bias estimate of the filter at each second, rad/s.
pub fn biases(seconds: &[Second]) -> Vec<f64> {
    let mut state = Vector::zeros();
    let mut covariance = Matrix::from_diagonal(&Vector::from(INITIAL.map(|sigma| sigma * sigma)));
    let walk = Matrix::from_diagonal(&Vector::from(WALK.map(|sigma| sigma * sigma)));
    let mut step = Matrix::identity();
    step[(1, 6)] = 1.0;
    let speed_of = |second: Option<&Second>| second.map(|second| (second.wheels[0] + second.wheels[1]) / 2.0);
    let filter = |(number, second): (usize, &Second)| {
        state = step * state;
        covariance = step * covariance * step.transpose() + walk;
        let Second { gyro, wheels: [left, right], stands, warmer } = *second;
        let (speed, difference) = ((left + right) / 2.0, (right - left) / TRACK);
        let before = speed_of(number.checked_sub(1).and_then(|before| seconds.get(before)));
        let after = speed_of(seconds.get(number + 1));
        let acceleration = (after.unwrap_or(speed) - before.unwrap_or(speed)) / 2.0;
        let bias = state[0] + state[4] * warmer;
        let turn = gyro - bias;
        let reading = if stands {
            Some((Vector::from([1.0, 0.0, 0.0, 0.0, warmer, 0.0, 0.0]), gyro, STANDING))
        } else {
            let by = [1.0, speed, turn, turn * speed * speed, warmer, acceleration * speed, 0.0];
            (speed > SLOW).then(|| (Vector::from(by), gyro - difference, MOVING.hypot(0.005 * turn)))
        };
        if let Some((by, reading, sigma)) = reading {
            let off = reading - by.dot(&state);
            let spread = by.dot(&(covariance * by)) + sigma * sigma;
            if off.abs() < GATE * spread.sqrt() {
                let gain = covariance * by / spread;
                state += gain * off;
                covariance -= gain * (by.transpose() * covariance);
                covariance = (covariance + covariance.transpose()) / 2.0;
            }
        }
        state[0] + state[4] * warmer
    };
    seconds.iter().enumerate().map(filter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn perfect_wheels_at_changing_speeds_show_the_bias() {
        let second = |k: usize| {
            let (speed, turn) = (20.0 + 8.0 * (0.02 * k as f64).sin(), 0.01 * (0.05 * k as f64).cos());
            let half = turn * TRACK / 2.0;
            let wheels = [(speed - half) * 1.001, speed + half];
            Second { gyro: turn + 0.001, wheels, stands: false, warmer: 0.0 }
        };
        let seconds: Vec<Second> = (0..1_200).map(second).collect();
        let last = *biases(&seconds).last().unwrap();
        assert!((last - 0.001).abs() < 3e-4, "{last}");
    }
}
