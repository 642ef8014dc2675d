//! Holds the errors of fibre-optic gyros, from their data sheets.

/// The errors of a part, without the Earth's rate, 1 sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FogErrors {
    /// Angle random walk, rad per square root of a second.
    pub angle_walk: f32,
    /// Bias of a part before it is measured, rad/s.
    pub bias: f32,
    /// Random walk of the bias, rad/s per square root of a second.
    pub bias_walk: f32,
    pub scale: f32,
}

const DEG_PER_HOUR: f32 = core::f32::consts::PI / 180.0 / 3600.0;
/// Square root of an hour, in square roots of a second.
const ROOT_HOUR: f32 = 60.0;

impl FogErrors {
    /// KVH DSP-1760: 0.012 deg per square root of an hour; a bias offset of 0.5 deg/h, taken as 2 sigma; a stability
    /// of 0.05 deg/h, taken as the random walk of an hour; 200 ppm.
    pub const DSP1760: Self = Self {
        angle_walk: 0.012 * 3600.0 * DEG_PER_HOUR / ROOT_HOUR,
        bias: 0.25 * DEG_PER_HOUR,
        bias_walk: 0.05 * DEG_PER_HOUR / ROOT_HOUR,
        scale: 200e-6,
    };
}
