//! Simulates the wheel encoders of a rear axle. The wheels' diameters differ from the calibration, and
//! the wheels slip when they drive or brake.
//!
//! Slip is proportional to the force: slip = a / (g k), with the normalised stiffness k of the tyres
//! (Rajamani, Vehicle Dynamics and Control, chapter 4).

use gyronet_tools::simulate::car::GRAVITY;
use gyronet_tools::simulate::purpose::Purpose;
use std::f64::consts::PI;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Diameters as calibrated, left and right, m.
    pub diameter: [f64; 2],
    /// Distance between the wheels as calibrated, m; it is also the true one.
    pub base: f64,
    /// Error common to both diameters, sigma, relative.
    pub common_error: f64,
    /// Additional error of each diameter, sigma, relative.
    pub wheel_error: f64,
    /// Normalised longitudinal stiffness: longitudinal acceleration, divided by g, that gives a slip of 1.
    pub slip_stiffness: f64,
}

#[derive(Debug, Clone)]
pub struct Odometer {
    config: Config,
    /// True diameters, m.
    diameter: [f64; 2],
    /// Revolutions since the start.
    turns: [f64; 2],
}

impl Odometer {
    /// Draws the true diameters for one run, because pressure and load change from day to day.
    pub fn new(config: &Config, run: u64) -> Self {
        let mut random = Purpose::Odometer.stream(run);
        let common = config.common_error * random.normal();
        let diameter = config.diameter.map(|d| d * (1.0 + common + config.wheel_error * random.normal()));
        Self { config: *config, diameter, turns: [0.0; 2] }
    }

    /// Advances by a time (s) at a speed along the road (m/s), an acceleration (m/s^2) and a heading rate (rad/s).
    pub fn step(&mut self, speed: f64, acceleration: f64, heading_rate: f64, seconds: f64) {
        let slip = acceleration / (GRAVITY * self.config.slip_stiffness);
        let half = heading_rate * self.config.base / 2.0;
        for (wheel, ground) in [speed - half, speed + half].into_iter().enumerate() {
            self.turns[wheel] += ground * (1.0 + slip) * seconds / (PI * self.diameter[wheel]);
        }
    }

    /// Returns the revolutions since the start, left and right.
    pub fn turns(&self) -> [f64; 2] {
        self.turns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: Config = Config {
        diameter: [0.62, 0.61],
        base: 1.5,
        common_error: 0.0,
        wheel_error: 0.0,
        slip_stiffness: 20.0,
    };

    fn metres(odometer: &Odometer) -> [f64; 2] {
        [0, 1].map(|wheel| odometer.turns()[wheel] * PI * EXACT.diameter[wheel])
    }

    #[test]
    fn exact_wheels_measure_the_way_and_the_turn() {
        let mut odometer = Odometer::new(&EXACT, 1);
        (0..1_000).for_each(|_| odometer.step(10.0, 0.0, 0.1, 0.01));
        let [left, right] = metres(&odometer);
        assert!(((left + right) / 2.0 - 100.0).abs() < 1e-9);
        assert!(((right - left) / 1.5 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn driven_wheels_turn_too_much_and_braked_ones_too_little() {
        let way = |acceleration| {
            let mut odometer = Odometer::new(&EXACT, 1);
            odometer.step(10.0, acceleration, 0.0, 1.0);
            metres(&odometer)[0]
        };
        assert!(way(2.0) > 10.0 && way(0.0) == 10.0 && way(-2.0) < 10.0);
        assert!((way(GRAVITY * 0.2) - 10.1).abs() < 1e-9, "a fifth of g: 1 %");
    }
}
