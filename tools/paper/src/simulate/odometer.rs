//! Simulates the wheel encoders of a rear axle. The wheels' diameters differ from the calibration, and
//! the wheels slip when they drive or brake.
//!
//! Slip is proportional to the force: slip = a / (g k), with the normalised stiffness k of the tyres
//! (Rajamani, Vehicle Dynamics and Control, chapter 4).

use gyronet_tools::simulate::car::GRAVITY;
use gyronet_tools::simulate::purpose::Purpose;
use std::f64::consts::PI;

/// Diameters as calibrated, left and right, m.
pub const DIAMETER: [f64; 2] = [0.623_022, 0.622_356];
/// Distance between the wheels as calibrated, m; it is also the true one.
pub const BASE: f64 = 1.5285;
/// Error common to both diameters, sigma, relative.
const COMMON_ERROR: f64 = 0.0006;
/// Additional error of each diameter, sigma, relative.
const WHEEL_ERROR: f64 = 0.000_03;
/// Normalised longitudinal stiffness: longitudinal acceleration, divided by g, that gives a slip of 1.
const SLIP_STIFFNESS: f64 = 30.0;

#[derive(Debug, Clone)]
pub struct Odometer {
    /// True diameters, m.
    diameter: [f64; 2],
    /// Revolutions since the start.
    turns: [f64; 2],
}

impl Odometer {
    /// Draws the true diameters for one run, because pressure and load change from day to day.
    pub fn new(run: u64) -> Self {
        let mut random = Purpose::Odometer.stream(run);
        let common = COMMON_ERROR * random.normal();
        let diameter = DIAMETER.map(|d| d * (1.0 + common + WHEEL_ERROR * random.normal()));
        Self { diameter, turns: [0.0; 2] }
    }

    /// Advances by a time (s) at a speed along the road (m/s), an acceleration (m/s^2) and a heading rate (rad/s).
    pub fn step(&mut self, speed: f64, acceleration: f64, heading_rate: f64, seconds: f64) {
        let slip = acceleration / (GRAVITY * SLIP_STIFFNESS);
        let half = heading_rate * BASE / 2.0;
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

    const EXACT: Odometer = Odometer { diameter: DIAMETER, turns: [0.0; 2] };

    fn metres(odometer: &Odometer) -> [f64; 2] {
        [0, 1].map(|wheel| odometer.turns()[wheel] * PI * DIAMETER[wheel])
    }

    #[test]
    fn exact_wheels_measure_the_way_and_the_turn() {
        let mut odometer = EXACT;
        (0..1_000).for_each(|_| odometer.step(10.0, 0.0, 0.1, 0.01));
        let [left, right] = metres(&odometer);
        assert!(((left + right) / 2.0 - 100.0).abs() < 1e-9);
        assert!(((right - left) / BASE - 1.0).abs() < 1e-9);
    }

    #[test]
    fn driven_wheels_turn_too_much_and_braked_ones_too_little() {
        let way = |acceleration| {
            let mut odometer = EXACT;
            odometer.step(10.0, acceleration, 0.0, 1.0);
            metres(&odometer)[0]
        };
        assert!(way(2.0) > 10.01 && (way(0.0) - 10.0).abs() < 1e-9 && way(-2.0) < 9.99);
        assert!((way(GRAVITY * 0.3) - 10.1).abs() < 1e-9, "0.3 g: 1 %");
    }
}
