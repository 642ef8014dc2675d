//! The pipeline needs two facts about the wheels: whether the vehicle stands, and whether a wheel has become silent.

use crate::sample::{Standstill, WHEELS, WheelSample};

/// Holds the newest report of the wheels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wheels {
    newest: Option<WheelSample>,
    /// Wheels that have had a speed.
    seen: [bool; WHEELS],
}

impl Wheels {
    /// The state before the first report.
    pub const START: Self = Self { newest: None, seen: [false; WHEELS] };

    /// Stores a report.
    pub fn update(&mut self, wheels: WheelSample) {
        for (seen, speed) in self.seen.iter_mut().zip(&wheels.speeds) {
            *seen |= speed.is_some();
        }
        self.newest = Some(wheels);
    }

    /// Returns the standstill that the wheels show; `None` before their first report.
    pub fn standstill(&self) -> Option<Standstill> {
        self.newest.map(|wheels| wheels.standstill)
    }

    /// Returns whether a wheel has lost its speed, or no wheel has one.
    pub fn are_silent(&self) -> bool {
        let Some(WheelSample { speeds, .. }) = self.newest else { return false };
        let lost = |(speed, seen): (&Option<_>, bool)| seen && speed.is_none();
        speeds.iter().all(Option::is_none) || speeds.iter().zip(self.seen).any(lost)
    }
}
