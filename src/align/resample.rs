//! This module interpolates an inertial sensor of any rate on the grid, linearly between two samples.
//!
//! | samples around the grid step | value |
//! |---|---|
//! | one exactly there | [`Quality::Exact`] |
//! | before and after, at most [`BRIDGE_US`] apart | [`Quality::Interpolated`] |
//! | before and after, at most [`MAX_GAP_US`] apart | [`Quality::Bridged`]: a gap, marked |
//! | only before, at most [`BRIDGE_US`] ago, when the caller can wait no longer | [`Quality::Held`] |
//! | otherwise | none |
//!
//! A part at 120 Hz has a sample after each step within 8.3 ms and is always interpolated; one
//! at 47 Hz within 21 ms, so a caller who waits 10 ms gets held values about half of the time,
//! and one who can wait 30 ms (a replay) gets interpolated ones. Linear interpolation is no
//! low-pass filter: let the part's own filter do that, and set it to 100 or 120 Hz rather than
//! to 1 kHz.

use crate::sample::ImuSample;
use crate::units::{AngularRate, Micros, SpecificForce};
use heapless::Deque;

/// Samples further apart than this have a gap between them: 47 Hz with its jitter fits in.
pub const BRIDGE_US: u64 = 25_000;
/// The longest gap that a value bridges.
pub const MAX_GAP_US: u64 = 100_000;
/// At most this many samples are kept: those that a 500 Hz part sends in the 20 ms that a step can be waited for.
pub const KEPT: usize = 16;

/// Says where a value on the grid comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Quality {
    /// A sample was taken at that very time.
    Exact,
    /// The value lies between two samples.
    Interpolated,
    /// The value lies between two samples with a gap between them.
    Bridged {
        /// Its length, microseconds.
        gap: u32,
    },
    /// The last sample, again.
    Held {
        /// Its age, microseconds.
        age: u32,
    },
}

/// Samples that a grid step may still need, times by the board's clock.
#[derive(Debug, Clone, Default)]
pub struct Resampler {
    samples: Deque<ImuSample, KEPT>,
    dropped: u32,
}

impl Resampler {
    /// Starts without a sample.
    pub const EMPTY: Self = Self { samples: Deque::new(), dropped: 0 };

    /// Takes a sample; its time is the board's and later than the last one's.
    pub fn add(&mut self, sample: ImuSample) {
        if self.samples.is_full() {
            self.samples.pop_front();
            self.dropped = self.dropped.saturating_add(1);
        }
        // There is room now.
        let _ = self.samples.push_back(sample);
    }

    /// Discards all samples.
    pub fn clear(&mut self) {
        self.samples.clear();
    }

    /// Returns whether a sample at or after `time` has come, so that [`Resampler::at`] need not wait.
    #[must_use]
    pub fn has_reached(&self, time: Micros) -> bool {
        self.samples.back().is_some_and(|sample| sample.time >= time)
    }

    /// Returns the number of samples that were dropped before a step asked for them.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Returns the value at `time`; times are asked for in ascending order.
    pub fn at(&mut self, time: Micros) -> Option<(ImuSample, Quality)> {
        // The newest sample at or before `time` stays at the front.
        while self.samples.iter().nth(1).is_some_and(|second| second.time <= time) {
            self.samples.pop_front();
        }
        let before = self.samples.front().filter(|sample| sample.time <= time)?;
        if before.time == time {
            return Some((*before, Quality::Exact));
        }
        let Some(after) = self.samples.iter().nth(1) else {
            let age = time.0 - before.time.0;
            let held = ImuSample { time, ..*before };
            return (age <= BRIDGE_US).then_some((held, Quality::Held { age: age as u32 }));
        };
        let gap = after.time.0 - before.time.0;
        let quality = match gap {
            0..=BRIDGE_US => Quality::Interpolated,
            _ if gap <= MAX_GAP_US => Quality::Bridged { gap: gap as u32 },
            _ => return None,
        };
        Some((between(before, after, time), quality))
    }
}

/// Interpolates linearly from one sample to the next, rounded to nearest; the result is valid if both are.
fn between(before: &ImuSample, after: &ImuSample, time: Micros) -> ImuSample {
    let span = (after.time.0 - before.time.0) as i64;
    let part = (time.0 - before.time.0) as i64;
    let line = |from: i32, to: i32| {
        // Below 2^32 x 100,000: far from 2^63.
        let rise = (i64::from(to) - i64::from(from)) * part;
        from.wrapping_add(((rise + rise.signum() * (span / 2)) / span.max(1)) as i32)
    };
    let (f, w) = (&before.specific_force, &before.angular_rate);
    ImuSample {
        time,
        specific_force: core::array::from_fn(|n| SpecificForce(line(f[n].0, after.specific_force[n].0))),
        angular_rate: core::array::from_fn(|n| AngularRate(line(w[n].0, after.angular_rate[n].0))),
        temperature: after.temperature.or(before.temperature),
        validity: if before.validity.is_good() { after.validity } else { before.validity },
    }
}
