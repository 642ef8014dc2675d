//! The rate of a vehicle that has stood without wheels, until it drives off.
//!
//! Inertial evidence shows late that it drives off, and it may pull away in a turn. But nothing takes two seconds to be
//! seen, so the second before those belongs to the rest, whatever the judge of standstills thought of it.

use crate::sample::RATE_HZ;

/// Samples of a part.
const PART: u32 = RATE_HZ / 2;
/// Whole parts in which the vehicle may pull away, and those before them that are compared.
const PULLS_AWAY: usize = 4;
const COMPARED: usize = 2;

/// Sums of the newest parts, rad/s, the newest one first and incomplete.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parked {
    sums: [f32; 1 + PULLS_AWAY + COMPARED],
    samples: u32,
}

impl Parked {
    pub const NONE: Self = Self { sums: [0.0; 1 + PULLS_AWAY + COMPARED], samples: 0 };

    /// Adds a rate, less the bias, rad/s.
    pub fn add(&mut self, rate: f32) {
        self.sums[0] += rate;
        self.samples = self.samples.saturating_add(1);
        if self.samples.is_multiple_of(PART) {
            self.sums.rotate_right(1);
            self.sums[0] = 0.0;
        }
    }

    /// Returns the mean of the second that ended two seconds ago or a little more, rad/s.
    pub fn before_pulling_away(&self) -> Option<f32> {
        let compared = self.sums.get(1 + PULLS_AWAY..)?;
        let is_whole = self.samples >= PART * (PULLS_AWAY + COMPARED) as u32;
        is_whole.then(|| compared.iter().sum::<f32>() / (PART * COMPARED as u32) as f32)
    }
}
