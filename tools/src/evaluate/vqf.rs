//! The heading of the orientation filter VQF: D. Laidig and T. Seel, VQF: Highly accurate IMU
//! orientation estimation with bias estimation and magnetic disturbance rejection, Information Fusion 91 (2023),
//! 187-204.
//!
//! VQF integrates the gyro, corrects the inclination by the acceleration that is low-passed in the almost inertial
//! frame, and estimates the gyro's bias at rest and in motion; the crate `vqf-rs` is a port of its authors' code. The
//! filter runs without a magnetometer and with the published parameters: 3 s for the acceleration, rest below 2 deg/s
//! and 0.5 m/s^2 for 1.5 s. On drives the bias estimate in motion is off: it assumes that accelerations average out
//! in 3 s, which a car's do not, and makes the 1 s error 1.5 times as large on the training drives.

use super::angle::wrap;
use crate::drive::DT;
use vqf_rs::{Quaternion, VQF};

pub struct Heading {
    filter: VQF,
    yaw: Option<f64>,
}

impl Heading {
    pub fn new(filter: VQF) -> Self {
        Self { filter, yaw: None }
    }

    /// Adds a sample of the gyro (rad/s) and the specific force (m/s^2), and returns the rate of the heading, rad/s.
    /// The first rate is zero.
    pub fn rate(&mut self, gyro: [f64; 3], force: [f64; 3]) -> f64 {
        self.filter.update(gyro, force, None);
        let Quaternion(w, x, y, z) = self.filter.quat_6d();
        let yaw = libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
        wrap(yaw - self.yaw.replace(yaw).unwrap_or(yaw)) / DT
    }
}

pub fn rates(filter: VQF, samples: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> Vec<f64> {
    let mut heading = Heading::new(filter);
    samples.map(|(gyro, force)| heading.rate(gyro, force)).collect()
}

pub fn published() -> VQF {
    VQF::new(DT, None, None, None)
}

pub fn on_a_vehicle() -> VQF {
    let mut filter = published();
    filter.set_motion_bias_est_enabled(false);
    filter
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: [f64; 3] = [0.0, 0.0, 9.81];

    #[test]
    fn the_bias_is_found_at_rest() {
        let bias = [0.01, -0.02, 0.015];
        for filter in [published(), on_a_vehicle()] {
            let rates = rates(filter, (0..2_000).map(|_| (bias, UP)));
            assert!(rates[100] > 0.01, "not yet: {}", rates[100]);
            assert!(rates[1_500..].iter().all(|rate| rate.abs() < 1e-4), "{:?}", &rates[1_500..1_505]);
        }
    }

    /// The vehicle turns 90 degrees to the left after 5 s at rest; the sensor is tilted by 10 degrees.
    #[test]
    fn a_turn_is_followed() {
        let (sin, cos) = 10.0_f64.to_radians().sin_cos();
        let turned = |z: f64| [0.0, z * sin, z * cos];
        let rate = |k: usize| if (500..1_000).contains(&k) { std::f64::consts::FRAC_PI_2 / 5.0 } else { 0.0 };
        let rates = rates(on_a_vehicle(), (0..1_200).map(|k| (turned(rate(k)), turned(9.81))));
        let yaw = rates.iter().sum::<f64>() * DT;
        assert!((yaw - std::f64::consts::FRAC_PI_2).abs() < 5e-3, "{yaw}");
    }
}
