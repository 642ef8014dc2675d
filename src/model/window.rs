//! A window holds the last ten samples as the networks see them: integer codes, the angular rate less the static bias.

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

/// Keeps the last [`WINDOW`] samples without a gap, in a ring.
#[derive(Debug, Clone)]
pub struct Window {
    ring: [Features; WINDOW],
    next: usize,
    filled: usize,
}

impl Default for Window {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Window {
    /// Starts without a sample.
    pub const EMPTY: Self = Self { ring: [[0; FEATURES]; WINDOW], next: 0, filled: 0 };

    /// Forgets everything: a gap breaks the window.
    pub fn clear(&mut self) {
        self.next = 0;
        self.filled = 0;
    }

    /// Adds the newest sample; a full window drops its oldest.
    pub fn add(&mut self, features: Features) {
        if let Some(place) = self.ring.get_mut(self.next) {
            *place = features;
        }
        self.next = (self.next + 1) % WINDOW;
        self.filled = (self.filled + 1).min(WINDOW);
    }

    /// Returns whether the window is full.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.filled == WINDOW
    }

    /// Returns the samples, oldest first; `None` until the window is full.
    #[must_use]
    pub fn snapshot(&self) -> Option<[Features; WINDOW]> {
        self.is_full().then(|| core::array::from_fn(|k| self.ring[(self.next + k) % WINDOW]))
    }
}
