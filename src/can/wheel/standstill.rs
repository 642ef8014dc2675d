//! The wheels decide whether the vehicle stands.
//!
//! Standing still is decided here, because a bias estimator that trusts the gyro alone takes a
//! slow turn for bias. It is asserted late and dropped at once: all wheels must have been fresh
//! and slow for a while, and one wheel that moves, is silent or not valid ends it. Wheel
//! sensors of the passive kind show zero below walking pace, hence the while.

use crate::sample::{Standstill, WHEELS, WheelSample};
use crate::units::{Duration, Micros, WheelSpeed};

/// The limits by which wheels count as standing, and as silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StandstillRule {
    /// A speed that is older says nothing.
    pub timeout: Duration,
    /// Up to this speed a wheel may stand still.
    pub still_speed: WheelSpeed,
    /// The time for which all wheels must be that slow.
    pub still_for: Duration,
}

/// The wheels of a vehicle: the newest speed of each, and since when they have been slow.
#[derive(Debug, Clone, Copy)]
pub struct Wheels {
    rule: StandstillRule,
    /// Wheels that there are.
    expected: [bool; WHEELS],
    speeds: [Option<(WheelSpeed, Micros)>; WHEELS],
    still_since: Option<Micros>,
}

impl Wheels {
    /// Begins before the first speed.
    #[must_use]
    pub const fn new(rule: StandstillRule, expected: [bool; WHEELS]) -> Self {
        Self { rule, expected, speeds: [None; WHEELS], still_since: None }
    }

    /// Drops speeds that are too old. Call it before new speeds are taken.
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

    /// Takes a wheel's speed; `None` where it is marked as not valid.
    pub fn set(&mut self, wheel: usize, speed: Option<WheelSpeed>, now: Micros) {
        if let Some(slot) = self.speeds.get_mut(wheel) {
            *slot = speed.map(|speed| (speed, now));
        }
    }

    /// Judges standing or moving by the speeds that have been set.
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
