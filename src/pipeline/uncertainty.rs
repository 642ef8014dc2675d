//! This module computes the expected error of a corrected rate.
//!
//! The number sent with each rate is the expected error of the mean rate over one second, 1 sigma: over a single sample
//! vibration outweighs every other error, and no car changes its heading much in 10 ms. Its two parts are taken as
//! independent: the network's, from the error that it predicts for its windows ([`crate::model::Estimate::scale`]), and
//! the bias's, from the zero-rate updates.

use crate::sqrt::sqrt;
use crate::units::AngularRate;

/// Holds the factors that turn the network's predicted error into the error over a second.
#[derive(Debug, Clone, Copy)]
pub struct UncertaintyConfig {
    /// Sigma of a second's error over the RMS of the scales of its windows.
    pub per_scale: f32,
    /// Sigma of a second that the network has not corrected, rad/s.
    pub uncorrected: f32,
}

impl UncertaintyConfig {
    /// These factors were calibrated on the validation drive alone (`cargo gyronet evaluate --ablation`).
    pub const DEFAULT: Self = Self { per_scale: 0.25, uncorrected: 2.5e-4 };
}

/// The network's predicted error is averaged over this many windows: about a second at the default hop.
const WINDOWS: f32 = 20.0;

/// Tracks the expected error of the corrected rate.
#[derive(Debug, Clone)]
pub struct Uncertainty {
    config: UncertaintyConfig,
    /// Running mean square of the windows' scales, (rad/s)^2.
    scale_square: Option<f32>,
}

impl Uncertainty {
    /// Creates the state before the first window.
    #[must_use]
    pub const fn new(config: UncertaintyConfig) -> Self {
        Self { config, scale_square: None }
    }

    /// Adds the error that the network predicts for a window.
    pub fn window(&mut self, scale: AngularRate) {
        let scale = scale.0 as f32 / AngularRate::PER_RAD_PER_SEC;
        let square = scale * scale;
        let before = self.scale_square.unwrap_or(square);
        self.scale_square = Some(before + (square - before) / WINDOWS);
    }

    /// Returns the sigma of a rate, rounded up, from the `bias` sigma in rad/s; a rate not `corrected` by the network
    /// has a fixed sigma in place of the network's.
    #[must_use]
    pub fn sigma(&self, corrected: bool, bias: f32) -> AngularRate {
        let UncertaintyConfig { per_scale, uncorrected } = self.config;
        let own = match self.scale_square {
            Some(scale_square) if corrected => per_scale * per_scale * scale_square,
            _ => uncorrected * uncorrected,
        };
        let sigma = sqrt(own + bias * bias);
        // Beyond the code's range the cast saturates.
        AngularRate(libm::ceilf(sigma * AngularRate::PER_RAD_PER_SEC) as i32)
    }
}
