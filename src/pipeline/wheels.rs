//! The pipeline needs two facts of the wheels: whether the vehicle stands, and whether a wheel has fallen silent.

use crate::sample::{Standstill, WHEELS, WheelSample};

/// The newest report of the wheels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wheels {
    newest: Option<WheelSample>,
    /// Wheels that have had a speed.
    seen: [bool; WHEELS],
}

impl Wheels {
    /// Nothing known of the wheels.
    pub const START: Self = Self { newest: None, seen: [false; WHEELS] };

    /// Takes a report.
    pub fn update(&mut self, wheels: WheelSample) {
        for (seen, speed) in self.seen.iter_mut().zip(&wheels.speeds) {
            *seen |= speed.is_some();
        }
        self.newest = Some(wheels);
    }

    /// Returns whether the vehicle stands; `None` where there are no wheels.
    pub fn standstill(&self) -> Option<Standstill> {
        self.newest.map(|wheels| wheels.standstill)
    }

    /// Returns whether a wheel that has had a speed has none now, or none has ever had one.
    pub fn are_silent(&self) -> bool {
        let Some(WheelSample { speeds, .. }) = self.newest else { return false };
        let lost = |(speed, seen): (&Option<_>, bool)| seen && speed.is_none();
        speeds.iter().all(Option::is_none) || speeds.iter().zip(self.seen).any(lost)
    }
}
