//! The slow mean follows the constant part of the corrections, so that it can be taken out of them.

/// Windows over which the mean goes back: 13 s with one every five samples.
const MEMORY: i64 = 256;
/// Fraction bits of the mean.
const Q: u32 = 16;

/// The mean of a value: of all so far, and later of about the last [`MEMORY`].
#[derive(Debug, Clone, Copy)]
pub(super) struct SlowMean {
    mean: i64,
    count: i64,
}

impl SlowMean {
    /// The mean before the first value is zero.
    pub(super) const NONE: Self = Self { mean: 0, count: 0 };

    /// Takes in a value, within 2^32.
    pub(super) fn observe(&mut self, value: i64) {
        self.count = (self.count + 1).min(MEMORY);
        let beyond = (value << Q) - self.mean;
        self.mean += beyond.checked_div(self.count).unwrap_or(0);
    }

    /// Returns the mean.
    pub(super) fn get(self) -> i64 {
        self.mean >> Q
    }
}
