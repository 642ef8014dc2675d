//! The turn by the gyro over the last seconds, in blocks of 100 ms: a course is older than the newest reading.

use crate::sample::RATE_HZ;
use crate::units::AngularRate;

/// Samples of a block, and the length of one in seconds.
pub(super) const BLOCK: u32 = 10;
pub(super) const BLOCK_SECONDS: f32 = BLOCK as f32 / RATE_HZ as f32;
/// The beginnings of the newest blocks that are kept: 3 s.
const KEPT: usize = 31;
/// Low-order bits that the kept sums drop, so that 40 rad fit.
const SHIFT: u32 = 8;
/// Blocks on either side over which a rate is taken.
const AROUND: f32 = 2.0;
const PER_RAD: f32 = AngularRate::PER_RAD_PER_SEC * RATE_HZ as f32;

#[derive(Debug, Clone)]
pub(super) struct Turns {
    /// Sum at the end of each block, the newest first; only differences have a meaning.
    ends: [i32; KEPT],
    filled: usize,
    sum: i64,
    block: i64,
    samples: u32,
}

impl Turns {
    pub const EMPTY: Self = Self { ends: [0; KEPT], filled: 0, sum: 0, block: 0, samples: 0 };

    /// Adds a sample; returns the turn of the block that ends with it, rad.
    pub fn add(&mut self, rate: AngularRate) -> Option<f32> {
        self.block += i64::from(rate.0);
        self.samples += 1;
        if self.samples < BLOCK {
            return None;
        }
        let block = core::mem::take(&mut self.block);
        self.samples = 0;
        self.sum = self.sum.wrapping_add(block);
        self.ends.rotate_right(1);
        self.ends[0] = (self.sum >> SHIFT) as i32;
        self.filled = (self.filled + 1).min(KEPT);
        Some(block as f32 / PER_RAD)
    }

    /// Returns the turn since this many blocks before the end of the newest one, rad, and the rate at that time, rad/s. A
    /// negative number is after it, with the newest rate. `None` before so much is known.
    pub fn since(&self, blocks: f32) -> Option<(f32, f32)> {
        let from = (blocks - AROUND).max(0.0);
        let (before, after) = (self.turned(from + 2.0 * AROUND)?, self.turned(from)?);
        let rate = (before - after) / (2.0 * AROUND * BLOCK_SECONDS);
        let turned = if blocks < 0.0 { blocks * BLOCK_SECONDS * rate } else { self.turned(blocks)? };
        Some((turned, rate))
    }

    fn turned(&self, blocks: f32) -> Option<f32> {
        let whole = libm::floorf(blocks);
        let at = |index: usize| {
            let known = self.ends.get(index).filter(|_| index < self.filled)?;
            let turned = self.ends[0].wrapping_sub(*known);
            Some(turned as f32 * ((1 << SHIFT) as f32 / PER_RAD))
        };
        let (before, part) = (at(whole as usize)?, blocks - whole);
        if part == 0.0 { Some(before) } else { Some(before + part * (at(whole as usize + 1)? - before)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_since_any_time_is_found() {
        let mut turns = Turns::EMPTY;
        assert_eq!(turns.since(0.0), None);
        // The rate grows by 0.01 rad/s each second; 40 rad and more are turned meanwhile.
        for step in 0..10_000u32 {
            turns.add(AngularRate::from_rad_per_sec(1e-4 * step as f32).unwrap());
        }
        for blocks in [-3.0, 0.0, 0.5, 7.25, 20.0] {
            let (turned, rate) = turns.since(blocks).expect("three seconds are kept");
            let ago = blocks * BLOCK_SECONDS;
            let due = if blocks < 2.0 { 1.0 - 0.002 } else { 1.0 - 0.01 * ago };
            assert!((rate - due).abs() < 2e-4, "{blocks}: {rate} is not {due}");
            let due = ago - if blocks < 0.0 { 0.002 * ago } else { 0.005 * ago * ago };
            assert!((turned - due).abs() < 3e-4, "{blocks}: {turned} is not {due}");
        }
        assert_eq!(turns.since(30.0), None);
    }
}
