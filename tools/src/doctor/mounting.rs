//! Computes the roll and pitch of the sensor's mounting from gravity at rest.

use super::finding::Finding;
use super::line::confused;
use super::recording::{Rows, sorted};
use super::remedy;

/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.806_65;
/// Tilt beyond which the mounting should be configured, and beyond which it must be, degrees.
const TILT: (f64, f64) = (15.0, 60.0);

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    pub roll_deg: f64,
    pub pitch_deg: f64,
    /// Magnitude of the specific force, m/s^2.
    pub force: f64,
    /// Mean specific force at rest, m/s^2.
    pub rest: [f64; 3],
}

impl Mounting {
    /// Computes the mounting from the specific force at rest; `None` if there is no force.
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

/// The accelerometer's unit where it is not m/s^2: by the median of the force, which is that of gravity on every drive.
fn unit(rows: &Rows) -> Option<String> {
    let sizes = sorted(rows.force.iter().map(|[x, y, z]| x.hypot(*y).hypot(*z)));
    let median = *sizes.get(sizes.len() / 2)?;
    let (_, unit) = [(1.0, "g"), (1e3, "mg")].into_iter().find(|(gravity, _)| confused(median, *gravity))?;
    Some(format!(
        "the force is {median:.2} where gravity is {GRAVITY:.2} m/s^2: {}.",
        remedy::imu(rows, unit)
    ))
}

pub fn finding(rows: &Rows, mounting: Option<&Mounting>, left_deg: f64) -> Finding {
    let what = "mounting";
    if let Some(unit) = unit(rows) {
        return Finding::bad(what, unit);
    }
    let Some(level @ Mounting { roll_deg, pitch_deg, force, .. }) = mounting else {
        return Finding::note(what, "No standstill in which to measure gravity.");
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
        Finding::bad(what, format!("{angles}: z is not up; {}.", remedy::mounting(rows, level, left_deg)))
    } else if tilt > TILT.0 {
        Finding::note(
            what,
            format!(
                "{angles}: the board finds and takes off such a tilt by itself, but better {}.",
                remedy::mounting(rows, level, left_deg)
            ),
        )
    } else {
        Finding::good(what, format!("{angles}."))
    }
}
