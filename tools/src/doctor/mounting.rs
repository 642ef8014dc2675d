//! This module computes how the sensor is mounted, by gravity at rest.

use super::finding::Finding;

/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.806_65;
/// A tilt beyond the first is worth naming, one beyond the second is a sensor on its side, degrees.
const TILT: (f64, f64) = (15.0, 60.0);

/// Holds the mounting as gravity shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    /// Degrees.
    pub roll_deg: f64,
    /// Degrees.
    pub pitch_deg: f64,
    /// Length of the specific force, m/s^2.
    pub force: f64,
    /// The specific force, m/s^2.
    pub rest: [f64; 3],
}

impl Mounting {
    /// Computes it from the specific force at rest; `None` without any force.
    pub(super) fn at_rest(force: &[[f64; 3]]) -> Option<Self> {
        let mean = |axis: usize| force.iter().map(|force| force[axis]).sum::<f64>() / force.len() as f64;
        let [x, y, z] = [0, 1, 2].map(mean);
        let length = (x * x + y * y + z * z).sqrt();
        (length > 0.1).then(|| Self {
            roll_deg: y.atan2(z).to_degrees(),
            pitch_deg: (-x).atan2(y.hypot(z)).to_degrees(),
            force: length,
            rest: [x, y, z],
        })
    }
}

pub fn finding(mounting: Option<&Mounting>) -> Finding {
    let what = "mounting";
    let Some(Mounting { roll_deg, pitch_deg, force, .. }) = mounting else {
        return Finding::note(what, "No standstill to see gravity at.");
    };
    let excess = force / GRAVITY - 1.0;
    let tilt = roll_deg.abs().max(pitch_deg.abs());
    let angles = format!(
        "roll {roll_deg:+.1} deg, pitch {pitch_deg:+.1} deg, specific force {force:.3} m/s^2, {:+.2} % of gravity",
        100.0 * excess
    );
    if excess.abs() > 0.1 {
        Finding::bad(what, format!("{angles}: the unit of the accelerometer is not m/s^2."))
    } else if tilt > TILT.1 {
        Finding::bad(what, format!("{angles}: z is not up; name the mounting in the vehicle file."))
    } else if tilt > TILT.0 {
        Finding::note(
            what,
            format!("{angles}: beyond {} deg the board levels by itself, better name it.", TILT.0),
        )
    } else {
        Finding::good(what, format!("{angles}."))
    }
}
