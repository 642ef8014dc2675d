//! The clock of a coprocessor: an outside one, made one that never goes back, or the inertial sensor's.
//!
//! All limits are measured against the newest time. If a clock is set back, its times are shifted from then on.

use crate::units::{Duration, Micros};

/// Time ends here, after 146,000 years, so that sums of times and limits do not overflow.
const END: Micros = Micros(1 << 62);

/// The clock that `now` comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Clock {
    /// `now` is an independent clock, and inputs arrive when they are measured: a board in a vehicle.
    #[default]
    Outside,
    /// Inputs arrive at another pace than they were measured at (a recording): only the inertial sensor's time stamps
    /// count, for everything but its silence and late windows.
    Sensor,
}

/// Keeps the newest time of both clocks, and the shift that is added to the outside one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Timeline {
    clock: Clock,
    pub now: Micros,
    shift_us: u64,
    /// Time stamp of the newest sample of the inertial sensor.
    pub sample: Micros,
}

impl Timeline {
    pub const fn new(clock: Clock) -> Self {
        Self { clock, now: Micros(0), shift_us: 0, sample: Micros(0) }
    }

    /// Advances to the clock's time and returns the shifted time; as an error, the time by which the clock went back.
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

    /// Returns the time that is used for the wheels, the latitude and the fibre-optic gyro.
    pub fn time(&self) -> Micros {
        match self.clock {
            Clock::Outside => self.now,
            Clock::Sensor => self.sample.min(END),
        }
    }

    /// Returns whether the outside clock tells nothing about the age of a reading.
    pub fn is_sensors(&self) -> bool {
        self.clock == Clock::Sensor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_goes_back_is_reported_once_and_followed() {
        let mut timeline = Timeline::new(Clock::Outside);
        assert_eq!(timeline.advance(Micros(1_000)), Ok(Micros(1_000)));
        assert_eq!(timeline.advance(Micros(1_000)), Ok(Micros(1_000)));
        assert_eq!(timeline.advance(Micros(400)), Err(Duration(600)));
        assert_eq!(timeline.advance(Micros(450)), Ok(Micros(1_050)));
        assert_eq!(timeline.advance(Micros(u64::MAX)), Ok(END));
        assert_eq!(timeline.advance(Micros(0)), Err(Duration(END.0 - 600)));
        assert_eq!(timeline.advance(Micros(1)), Ok(END), "it stands still and does not wrap");
    }
}
