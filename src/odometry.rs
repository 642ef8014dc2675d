//! Planar dead reckoning computes a position from wheel speeds and a yaw rate (equations 3 to 5 of the paper).
//!
//! The paper's x grows by v cos(psi) dt, y by v sin(psi) dt and psi by the corrected yaw rate times dt, with v the
//! mean of the left and the right wheel. Here psi is the heading in the middle of the step: the heading at the
//! beginning of the step, as in equation 4, lags by half a step and shifts the path by v dt / 2 times the change of
//! heading in every turn.
//!
//! [`Track`] is in f64, for hosts. [`Odometry`] is what a board runs: heading and position are integers, so that the
//! small steps of a long drive are not lost; only sine and cosine are f32 (libm's, the same bits on every machine).
//! Against [`Track`] its position is off by no more than [`Odometry::ERROR_PER_METRE`] of the distance plus
//! [`Odometry::ERROR_PER_STEP_M`] a step, and its heading by [`Odometry::HEADING_ERROR_PER_STEP_RAD`] a step.

use crate::units::{Angle, AngularRate, Length, WheelSpeed};

/// Computes a path by dead reckoning in f64: m and rad, x ahead and y to the left of heading 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Track {
    /// Position, m.
    pub position: [f64; 2],
    /// Heading, not wrapped, rad.
    pub yaw: f64,
}

impl Track {
    /// Advances by one step: the distance of the left and the right wheel, m, and the turn of the vehicle, rad.
    pub fn step(&mut self, wheels: [f64; 2], turned: f64) {
        let [left, right] = wheels;
        let middle = self.yaw + turned / 2.0;
        let distance = (left + right) / 2.0;
        self.position[0] += distance * libm::cos(middle);
        self.position[1] += distance * libm::sin(middle);
        self.yaw += turned;
    }
}

/// Computes a path by dead reckoning in integers, for a board: steps of 2^-32 m and 2^-44 rad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Odometry {
    /// Position: ahead of heading 0 and to the left of it.
    pub position: [Length; 2],
    /// Heading, not wrapped.
    pub yaw: Angle,
}

/// A full turn in codes of [`Angle`] is 2 pi x 2^44, rounded.
const TURN: i64 = 110_534_964_875_444;

impl Odometry {
    /// The position error grows by at most this per metre of distance, m: an f32 holds an angle within pi to
    /// 1.2e-7 rad and its sine to 6e-8, in each of two axes; the heading adds 2e-7 in ten hours of 100 steps a
    /// second.
    pub const ERROR_PER_METRE: f64 = 5e-7;
    /// The position error grows by at most this per step, m: rounding costs half a code of [`Length`], 1.2e-10 m, for
    /// the distance and in each axis.
    pub const ERROR_PER_STEP_M: f64 = 3e-10;
    /// The heading error grows by at most this per step, rad: half a code of [`Angle`] for the turn and half a code for
    /// its half.
    pub const HEADING_ERROR_PER_STEP_RAD: f64 = 6e-14;

    /// Advances by one step of `span` microseconds at these speeds of the left and the right wheel and this corrected
    /// yaw rate.
    pub fn step(&mut self, wheels: [WheelSpeed; 2], yaw_rate: AngularRate, span: u32) {
        let [left, right] = wheels.map(|speed| i128::from(speed.0));
        let span = i128::from(span);
        // 2^-16 m/s x 1 us, halved, in codes of 2^-32 m; 2^-27 rad/s x 1 us in codes of 2^-44 rad.
        let distance = rounded((left + right) * span * (1 << (Length::FRACTION_BITS - 17)));
        let turned = rounded(
            i128::from(yaw_rate.0) * span * (1 << (Angle::FRACTION_BITS - AngularRate::FRACTION_BITS)),
        );
        self.advance(Length(distance), Angle(turned));
    }

    /// Advances by one step: the distance and the turn of the vehicle.
    pub fn advance(&mut self, distance: Length, turned: Angle) {
        let middle = self.yaw.0.wrapping_add(turned.0 / 2);
        let wrapped = (middle.wrapping_add(TURN / 2)).rem_euclid(TURN) - TURN / 2;
        let radians = wrapped as f32 / Angle::PER_RAD;
        let [x, y] = &mut self.position;
        x.0 = x.0.saturating_add(along(distance, libm::cosf(radians)));
        y.0 = y.0.saturating_add(along(distance, libm::sinf(radians)));
        self.yaw = Angle(self.yaw.0.wrapping_add(turned.0));
    }
}

/// Rounds to the nearest code; a value beyond the range saturates.
fn rounded(code_micros: i128) -> i64 {
    let half = 500_000 * code_micros.signum();
    let code = (code_micros + half) / 1_000_000;
    code.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
}

/// Returns the distance times a factor, as exact as the factor.
fn along(distance: Length, part: f32) -> i64 {
    // The factor is exact from 2^-6 on, and to 1e-9 below.
    const BITS: u32 = 30;
    let part = (part * (1u32 << BITS) as f32) as i128;
    ((i128::from(distance.0) * part + (1 << (BITS - 1))) >> BITS) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_two_pi() {
        let exact = core::f64::consts::TAU * f64::from(Angle::PER_RAD);
        assert!((exact - TURN as f64).abs() <= 0.5, "{exact}");
    }
}
