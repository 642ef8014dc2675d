//! A bias that nothing but one standstill has shown: the deck of a ferry or a turntable may have turned meanwhile.
//!
//! A vehicle drives off from ground that stands. So the last acceptable reading within [`CONFIRMING`] samples before
//! it moves decides; or the next stop. Until then all that the deck may turn by is part of sigma.

use crate::sample::RATE_HZ;

/// Samples after three seconds at rest within which the vehicle begins to move from there.
const CONFIRMING: u32 = 10 * RATE_HZ;

#[derive(Debug, Clone)]
pub(super) struct Claim {
    /// Reading at rest, and the sigma of what is expected of it, by earlier drives or the part's kind, rad/s.
    reading: f32,
    expected: f32,
    /// Mean of the newest acceptable three seconds, its sigma, rad/s, and the samples that they are evidence for.
    newest: (f32, f32),
    counts_for: u32,
    pub has_moved: bool,
}

impl Claim {
    pub const fn new(reading: f32, expected: f32, sigma: f32) -> Self {
        Self { reading, expected, newest: (0.0, sigma), counts_for: CONFIRMING, has_moved: false }
    }

    pub fn pass_on(&mut self) {
        self.counts_for = self.counts_for.saturating_sub(1);
    }

    /// Takes three more seconds at rest before the vehicle moves.
    pub fn rest(&mut self, mean: f32, sigma: f32) {
        if !self.has_moved {
            (self.newest, self.counts_for) = ((mean, sigma), CONFIRMING);
        }
    }

    /// Notes that the vehicle moves. Returns the bias and its sigma if the newest reading at rest is evidence.
    pub fn moves(&mut self) -> Option<(f32, f32)> {
        self.has_moved = true;
        (self.counts_for > 0).then_some(self.newest)
    }

    /// The variance of what the deck may turn by, (rad/s)^2.
    pub fn variance(&self) -> f32 {
        self.reading * self.reading + self.expected * self.expected
    }
}
