//! The gain of the yaw gyro that courses have shown, kept over starts.
//!
//! A gain is that of the rate behind the model and the unit's map, so it is stored with their checksum and used with the
//! same ones only. Its sigma grows at the next start by what a part's gain may change in between; new courses reduce it.

/// What a gain may change by from one start to the next, 1 sigma.
const AGED: f32 = 0.0016;
/// Largest sigma of a gain that is kept: given back, it is still better than what is known of a part.
const KEPT: f32 = 0.002;
pub(super) const MAX_GAIN: f32 = 0.05;
/// Ratio of sigmas, and change over the sigma, from which a gain replaces the stored one.
const BETTER: f32 = 0.7;

/// A gain of the yaw gyro.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gain {
    /// Share of the rate that the gyro reads too much.
    pub share: f32,
    /// Its accuracy, 1 sigma.
    pub sigma: f32,
    /// The model and map with which it was found.
    pub of: u32,
}

impl Gain {
    /// Returns the gain with the sigma that it has at the next start.
    #[must_use]
    pub fn aged(self) -> Self {
        Self { sigma: crate::sqrt::sqrt(self.sigma * self.sigma + AGED * AGED), ..self }
    }

    /// Returns whether it should replace a stored one.
    pub fn replaces(&self, stored: Option<&Self>) -> bool {
        self.sigma <= KEPT
            && stored.is_none_or(|stored| {
                let moved = libm::fabsf(self.share - stored.share);
                stored.of != self.of || self.sigma < BETTER * stored.sigma || moved > stored.sigma
            })
    }

    /// Returns whether it can be a part's.
    pub fn is_plausible(&self) -> bool {
        libm::fabsf(self.share) <= MAX_GAIN && self.sigma > 0.0 && self.sigma <= KEPT
    }
}
