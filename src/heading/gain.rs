//! The gain of the yaw gyro that courses have shown, kept over starts.
//!
//! A gain belongs to the model and the map of the unit that the rate has run through, so it names them and counts only
//! with the same. At the next start it is given back less certain, by what a part may change meanwhile; the courses of
//! that start confirm it.

/// What a gain may change by from one start to the next, 1 sigma.
const AGED: f32 = 0.0016;
/// Largest sigma of a gain that is kept: given back, it is still better than what is known of a part.
const KEPT: f32 = 0.002;
/// Largest gain.
pub(super) const MAX_GAIN: f32 = 0.05;
/// Ratio of sigmas, and change over the sigma, from which a gain is stored anew.
const BETTER: f32 = 0.7;

/// A gain.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// Returns it as it counts at the start after the one that has found it.
    #[must_use]
    pub fn aged(self) -> Self {
        Self { sigma: crate::sqrt::sqrt(self.sigma * self.sigma + AGED * AGED), ..self }
    }

    /// Returns whether it should replace a stored one.
    #[must_use]
    pub fn replaces(&self, stored: Option<&Self>) -> bool {
        self.sigma <= KEPT
            && stored.is_none_or(|stored| {
                let moved = libm::fabsf(self.share - stored.share);
                stored.of != self.of || self.sigma < BETTER * stored.sigma || moved > stored.sigma
            })
    }

    /// Returns whether it can be a part's.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        libm::fabsf(self.share) <= MAX_GAIN && self.sigma > 0.0 && self.sigma <= KEPT
    }
}
