//! Rounding residuals of signals.
//!
//! If each message were rounded on its own, a constant rate would give the same rounding error every time, and the
//! errors would add up. So each message's rounding residual is added to the next value: the sum of the rates sent
//! differs from the sum of the exact rates by at most half an LSB. The arithmetic is exact: the scale is a fixed-point
//! constant, and products are kept to their last bit.

use crate::units::AngularRate;

/// Converts a rate code (LSB 2^-27 rad/s) to the code of a CAN signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Scale {
    /// Signal LSBs per rate code, times 2^32; at most 2^31, because a signal LSB below two rate codes would gain
    /// nothing.
    pub(super) factor_q32: i64,
}

impl Scale {
    /// Scale for a signal LSB of 1e-6 deg/s: 180 / pi / 2^27 / 1e-6, too small by 2.3e-10.
    pub(super) const MICRO_DEG_PER_SEC: Self = Self { factor_q32: 1_833_464_944 };
    /// Scale for a signal LSB of 2e-4 deg/s.
    pub(super) const FIFTH_MILLI_DEG_PER_SEC: Self = Self { factor_q32: 9_167_325 };
}

/// Carries the rounding residual of one signal to its next code.
#[derive(Debug, Clone, Copy)]
pub(super) struct RoundingResidual {
    scale: Scale,
    /// Sum of the exact values minus the sum of the codes sent, in LSB x 2^-32.
    residual: i64,
}

impl RoundingResidual {
    pub(super) const fn new(scale: Scale) -> Self {
        Self { scale, residual: 0 }
    }

    /// Returns the code nearest to the rate plus the residual of earlier rates.
    pub(super) fn encode(&mut self, rate: AngularRate) -> i32 {
        // At most 2^62 + 2^31.
        let wanted = i64::from(rate.0) * self.scale.factor_q32 + self.residual;
        let sent = (wanted + (1 << 31)) >> 32;
        self.residual = wanted - (sent << 32);
        sent as i32
    }

    /// Drops the residual. Call it after a message that was marked bad, or at a restart.
    pub(super) fn reset(&mut self) {
        self.residual = 0;
    }
}
