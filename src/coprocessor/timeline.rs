//! The timeline turns an outside clock into a time that never goes back.
//!
//! All limits (silence, late windows, old wheel speeds) are measured against the newest time. A clock that is set
//! back must neither make these differences negative nor stall them until it has caught up, so its times are shifted
//! from then on.

use crate::units::{Duration, Micros};

/// Time ends here, after 146,000 years, so that sums of times and limits do not overflow.
pub(super) const END: Micros = Micros(1 << 62);

/// Keeps the newest time, and the shift that is added to the clock.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Timeline {
    now: Micros,
    shift_us: u64,
}

impl Timeline {
    /// The timeline at time 0.
    pub const START: Self = Self { now: Micros(0), shift_us: 0 };

    /// Advances to the clock's time and returns the shifted time.
    ///
    /// # Errors
    /// The time by which the clock went back. The next call continues from the newest time.
    pub fn advance(&mut self, clock: Micros) -> Result<Micros, Duration> {
        let shifted = clock.0.saturating_add(self.shift_us).min(END.0);
        if let Some(by_us @ 1..) = self.now.0.checked_sub(shifted) {
            self.shift_us = self.shift_us.saturating_add(by_us);
            return Err(Duration(by_us));
        }
        self.now = Micros(shifted);
        Ok(self.now)
    }

    /// Returns the shifted time of the clock, never before the newest one.
    pub fn at(&self, clock: Micros) -> Micros {
        Micros(clock.0.saturating_add(self.shift_us)).min(END).max(self.now)
    }

    /// Returns the newest time.
    pub const fn now(&self) -> Micros {
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_goes_back_is_reported_once_and_followed() {
        let mut timeline = Timeline::default();
        assert_eq!(timeline.advance(Micros(1_000)), Ok(Micros(1_000)));
        assert_eq!(timeline.advance(Micros(1_000)), Ok(Micros(1_000)));
        assert_eq!(timeline.advance(Micros(400)), Err(Duration(600)));
        assert_eq!(timeline.advance(Micros(450)), Ok(Micros(1_050)));
        assert_eq!(timeline.advance(Micros(u64::MAX)), Ok(END));
        assert_eq!(timeline.advance(Micros(0)), Err(Duration(END.0 - 600)));
        assert_eq!(timeline.advance(Micros(1)), Ok(END), "it stands still and does not wrap");
    }
}
