//! A bias that nothing but one standstill has shown: the deck of a ferry or a turntable may have turned meanwhile.
//!
//! A vehicle drives off from ground that stands. So the reading decides that static initialisation would accept last, within
//! [`CONFIRMING`] samples before the vehicle begins to move; or the next stop. Until then all that the deck may turn by is
//! part of sigma.

use crate::sample::RATE_HZ;

/// Samples after three seconds at rest within which the vehicle begins to move from there.
const CONFIRMING: u32 = 10 * RATE_HZ;

#[derive(Debug, Clone)]
pub(super) struct Claim {
    /// What the deck may turn by: the reading at rest, and the sigma of what earlier drives or the part's kind let
    /// expect of it, rad/s.
    reading: f32,
    expected: f32,
    /// Mean of the newest three seconds that static initialisation would accept and its sigma, rad/s, and the samples for
    /// which they are evidence.
    newest: (f32, f32),
    counts_for: u32,
    has_moved: bool,
}

impl Claim {
    pub const fn new(reading: f32, expected: f32, sigma: f32) -> Self {
        Self { reading, expected, newest: (0.0, sigma), counts_for: CONFIRMING, has_moved: false }
    }

    /// Counts a sample.
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

    pub const fn has_moved(&self) -> bool {
        self.has_moved
    }

    /// The variance of what the deck may turn by, (rad/s)^2.
    pub fn variance(&self) -> f32 {
        self.reading * self.reading + self.expected * self.expected
    }
}
