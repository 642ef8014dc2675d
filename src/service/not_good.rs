//! A rate that is not good for long, although no fault says why.
//!
//! Such a rate is honest, but it stays so for ever where nothing that would end it comes about: a vehicle that never
//! stands, a second standstill. So it becomes a trouble. Time in which the vehicle stands does not count, since a parked
//! board has nothing to wait for.

use crate::health::{Faults, Quality};
use crate::sample::RATE_HZ;
use crate::standstill::Standing;

/// Samples after which a trouble is present: ten minutes of driving.
const LONG: u32 = 600 * RATE_HZ;

/// Counts the samples of a moving vehicle since the rate was good or had a fault.
#[derive(Debug, Clone, Copy)]
pub(super) struct NotGood(u32);

impl NotGood {
    pub const START: Self = Self(0);

    pub fn observe(&mut self, quality: Quality, faults: Faults, standing: &Standing) {
        if quality == Quality::Good || faults != Faults::NONE {
            *self = Self::START;
        } else if !standing.is_likely() {
            self.0 = self.0.saturating_add(1);
        }
    }

    pub fn is_long(self) -> bool {
        self.0 >= LONG
    }
}
