//! This clock computes the time of a message by counting messages, because they carry no time stamp.

use super::config::OutputRate;

/// The time from the number of messages since the start, microseconds. At 750 messages a second the period is not a
/// whole number, so the remainder is carried and the clock never drifts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MessageClock {
    time: u64,
    /// The remainder of the last division by the rate.
    remainder: u32,
}

impl MessageClock {
    pub(super) const START: Self = Self { time: 0, remainder: 0 };

    /// Advances by `messages` (at most 127) and returns the new time.
    pub(super) fn advance(&mut self, rate: OutputRate, messages: u32) -> u64 {
        // No rate is zero; `max` shows the compiler that no division by zero can occur.
        let hertz = u32::from(rate.hertz()).max(1);
        let elapsed = messages * 1_000_000 + self.remainder;
        self.time += u64::from(elapsed / hertz);
        self.remainder = elapsed % hertz;
        self.time
    }
}
