//! Derives standstill from the wheel speeds.
//!
//! Standstill is derived from the wheels because a bias estimator that relies on the gyro alone mistakes a
//! slow turn for bias. It is reported late and withdrawn at once: all wheels must have been fresh
//! and slow for some time, and a single wheel that moves, is stale or not valid ends it. The delay is needed because
//! passive wheel sensors read zero below walking pace.

use crate::sample::{Standstill, WHEELS, WheelSample};
use crate::units::{Duration, Micros, WheelSpeed};

/// The limits for a wheel that is still and for a speed that is stale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StandstillRule {
    /// Age above which a speed is stale.
    pub timeout: Duration,
    /// Highest speed at which a wheel counts as still.
    pub still_speed: WheelSpeed,
    /// Time for which all wheels must be that slow.
    pub still_for: Duration,
}

/// The newest speed of each wheel, and the time since which all have been slow.
#[derive(Debug, Clone, Copy)]
pub struct Wheels {
    rule: StandstillRule,
    /// Wheels that have a signal.
    expected: [bool; WHEELS],
    speeds: [Option<(WheelSpeed, Micros)>; WHEELS],
    still_since: Option<Micros>,
}

impl Wheels {
    /// Creates the state before the first speed.
    #[must_use]
    pub const fn new(rule: StandstillRule, expected: [bool; WHEELS]) -> Self {
        Self { rule, expected, speeds: [None; WHEELS], still_since: None }
    }

    /// Drops stale speeds. Call it before setting new speeds.
    pub fn expire(&mut self, now: Micros) {
        for slot in &mut self.speeds {
            if let Some((_, at)) = slot
                && now.since(*at) > self.rule.timeout
            {
                *slot = None;
            }
        }
        if !self.complete() {
            self.still_since = None;
        }
    }

    /// Sets the speed of a wheel; `None` if it is marked as not valid.
    pub fn set(&mut self, wheel: usize, speed: Option<WheelSpeed>, now: Micros) {
        if let Some(slot) = self.speeds.get_mut(wheel) {
            *slot = speed.map(|speed| (speed, now));
        }
    }

    /// Updates the standstill state from the speeds that have been set.
    pub fn judge(&mut self, now: Micros) {
        let limit = self.rule.still_speed.0.unsigned_abs();
        let slow = self.speeds.iter().flatten().all(|(speed, _)| speed.0.unsigned_abs() <= limit);
        if slow && self.complete() {
            self.still_since.get_or_insert(now);
        } else {
            self.still_since = None;
        }
    }

    /// Returns the newest speeds, and whether the vehicle stands.
    #[must_use]
    pub fn sample(&self, now: Micros) -> WheelSample {
        let standstill = match self.still_since {
            Some(since) if now.since(since) >= self.rule.still_for => Standstill::Still,
            Some(_) => Standstill::Unknown,
            None if self.complete() => Standstill::Moving,
            None => Standstill::Unknown,
        };
        WheelSample { time: now, speeds: self.speeds.map(|speed| speed.map(|(speed, _)| speed)), standstill }
    }

    /// Returns whether every expected wheel has a fresh speed.
    fn complete(&self) -> bool {
        self.speeds.iter().zip(self.expected).all(|(speed, expected)| speed.is_some() || !expected)
    }
}
