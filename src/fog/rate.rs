//! Converts increments to rates without an error in the sum.

use crate::sample::RATE_HZ;
use crate::units::{Angle, AngularRate};

/// Codes of [`Angle`] in the turn that one code of [`AngularRate`] makes in a second.
const CODES: i64 = 1 << (Angle::FRACTION_BITS - AngularRate::FRACTION_BITS);
const FRAMES: i64 = RATE_HZ as i64;

/// Computes each frame's mean rate with carried residuals: the sum of rates is within one code of the turns'.
#[derive(Debug, Clone, Copy, Default)]
pub struct IncrementRate {
    rest: i64,
}

impl IncrementRate {
    pub const START: Self = Self { rest: 0 };

    /// Returns the rate of a frame with this turn, saturated at the limits of [`AngularRate`].
    pub fn rate(&mut self, turn: Angle) -> AngularRate {
        let codes = turn.0.saturating_mul(FRAMES).saturating_add(self.rest);
        let rate = codes.div_euclid(CODES).clamp(i32::MIN.into(), i32::MAX.into());
        self.rest = codes.rem_euclid(CODES);
        AngularRate(rate as i32)
    }
}
