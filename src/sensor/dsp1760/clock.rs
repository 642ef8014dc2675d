//! The clock computes the time of a message from its number, because the message carries no time.

use super::config::OutputRate;

/// Computes time from the number of messages since the start, microseconds. At 750 a second the period is not a whole
/// number, so the remainder is carried and the clock never drifts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MessageClock {
    time: u64,
    /// The remainder of the last division by the rate.
    remainder: u32,
}

impl MessageClock {
    pub(super) const START: Self = Self { time: 0, remainder: 0 };

    /// Returns the time `messages` (127 at most) later.
    pub(super) fn advance(&mut self, rate: OutputRate, messages: u32) -> u64 {
        // No rate is zero; the maximum shows the compiler that no division by zero can occur.
        let hertz = u32::from(rate.hertz()).max(1);
        let elapsed = messages * 1_000_000 + self.remainder;
        self.time += u64::from(elapsed / hertz);
        self.remainder = elapsed % hertz;
        self.time
    }
}
