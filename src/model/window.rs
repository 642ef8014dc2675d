//! A window holds the last ten samples as the networks see them: integer codes, the angular rate less the static bias.

use super::ring::Ring;
use crate::sample::ImuSample;
use crate::units::AngularRate;

/// A GyroNet window has this many samples: 0.1 s at 100 Hz (section III-B of the paper).
pub const WINDOW: usize = 10;
/// A sample has this many features: specific force x, y, z, then angular rate x, y, z.
pub const FEATURES: usize = 6;

/// Holds the features of one sample, in the codes of [`crate::units`].
pub type Features = [i32; FEATURES];

/// Returns the features of a sample, its angular rate less the static bias.
#[must_use]
pub fn features(sample: &ImuSample, gyro_bias: &[AngularRate; 3]) -> Features {
    let [fx, fy, fz] = sample.specific_force;
    let rate = |axis: usize| sample.angular_rate[axis].0.saturating_sub(gyro_bias[axis].0);
    [fx.0, fy.0, fz.0, rate(0), rate(1), rate(2)]
}

/// Keeps the last [`WINDOW`] samples without a gap.
pub type Window = Ring<Features, WINDOW>;

impl Window {
    /// A window without a sample.
    pub const EMPTY: Self = Self::without_elements([0; FEATURES]);
}
