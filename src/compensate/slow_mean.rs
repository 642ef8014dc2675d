//! The slow mean of a model's corrections: a constant that belongs to the unit that it was trained with.

const MEMORY: i64 = 1_280;
const Q: u32 = 16;

/// The mean of a value: of all so far, and later of about the last [`MEMORY`] samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlowMean {
    mean: i64,
    count: i64,
}

impl SlowMean {
    pub(super) const NONE: Self = Self { mean: 0, count: 0 };

    /// Adds a value, within 2^32; values arrive every `stride` samples.
    pub(super) fn observe(&mut self, value: i64, stride: u32) {
        let most = MEMORY.checked_div(stride.into()).unwrap_or(MEMORY);
        self.count = (self.count + 1).min(most);
        let beyond = (value << Q) - self.mean;
        self.mean += beyond.checked_div(self.count).unwrap_or(0);
    }

    pub(super) fn get(self) -> i64 {
        self.mean >> Q
    }
}
