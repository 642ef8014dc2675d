//! The configuration of the zero-rate updates is a plain value, separate from their state.

#[derive(Debug, Clone, Copy)]
pub struct ZeroRateConfig {
    /// Bias left by static initialisation, rad/s.
    pub initial: f32,
    /// Random walk of the bias, rad/s per square root of a second.
    pub walk: f32,
    /// Offset of a standstill, rad/s.
    pub standstill: f32,
    /// Least noise of a one-second mean, rad/s: a smaller spread is raised to it.
    pub noise: f32,
    /// Yaw rate of a vehicle that is taken for a standing one, rad/s: a bend of 6 km at 110 km/h. The smoothest driven
    /// seconds of the training drives turn by up to twice as much, RMS by half as much.
    pub mistaken: f32,
    /// Largest bias, and largest uncertainty of it, rad/s.
    pub max_bias: f32,
}

impl ZeroRateConfig {
    /// A MEMS part on a car. The walk is published for an Xsens MTi-100 (OpenVINS, `config/kaist`); the noise is less
    /// than half of its 1.7e-4 rad/s/sqrt(Hz), so that a better part benefits. The offset is measured: from standing
    /// to driving the mean error changes by 1.3e-4 rad/s RMS. Static initialisation may be off by 5 deg/s, so the bias
    /// may change by as much.
    pub const DEFAULT: Self =
        Self { initial: 1e-4, walk: 1e-5, standstill: 1.4e-4, noise: 5e-5, mistaken: 5e-3, max_bias: 0.1 };

    /// Returns the sigma of the bias by three seconds at rest, whose means differ by `drift`, rad/s: a difference beyond five
    /// sigma is a change that goes on, and is added.
    pub(super) fn after_rest(&self, drift: f32) -> f32 {
        self.initial.max(drift - 5.0 * self.initial)
    }
}
