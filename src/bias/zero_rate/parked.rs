//! The rate of a vehicle that has stood without wheels, until it drives off.
//!
//! Inertial evidence shows late that it drives off, and it may pull away in a turn. But nothing takes two seconds to be
//! seen, so the second before those belongs to the rest, whatever the judge of standstills thought of it.

use crate::sample::RATE_HZ;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_that_ended_two_seconds_ago_is_compared() {
        let mut parked = Parked::NONE;
        for sample in 0..6 * RATE_HZ {
            let expected = match sample / PART {
                0..6 => None,
                9 | 11 => Some(0.01),
                10 => Some(0.02),
                _ => Some(0.0),
            };
            let is_close = |mean: f32| expected.is_some_and(|expected: f32| (mean - expected).abs() < 1e-6);
            assert_eq!(parked.before_pulling_away().map(is_close), expected.map(|_| true), "sample {sample}");
            // A turn of a second, the third of six.
            parked.add(if sample / RATE_HZ == 2 { 0.02 } else { 0.0 });
        }
    }
}
