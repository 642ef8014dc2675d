//! The angle of a rate.

use crate::drive::DT;
use std::f64::consts::{PI, TAU};

/// Returns the angle after each sample of a rate, rad.
pub fn integral(rates: &[f64]) -> Vec<f64> {
    let step = |angle: &mut f64, rate: &f64| {
        *angle += rate * DT;
        Some(*angle)
    };
    rates.iter().scan(0.0, step).collect()
}

/// Wraps an angle to -pi to pi.
pub fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}
