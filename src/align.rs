//! This module gives each sample a step of the common 100 Hz grid by its time stamp.
//!
//! The rule: the first sample sets the grid. A later one belongs to the step nearest to its
//! time stamp, and must come within [`TOLERANCE_US`] of it; the grid then follows the sample,
//! so that a clock which is slow or fast by some percent never runs out of step. A sample that
//! is a duplicate, older than the last one or off the grid is an error and leaves the grid as
//! it was. A jump of more than a second either way (a part that restarted, a cable that came
//! back) is an error too, and the grid begins again from there: no wait without a bound.
//!
//! That is for one stream that comes at 100 Hz by itself, by the part's own clock. Streams of
//! other rates, and two or more parts with a clock each, go through [`streams`] first: it takes
//! the parts' clocks to the board's ([`clock`]), interpolates ([`resample`]) and sums
//! ([`increments`]), and its samples lie on the grid. How fast a single stream's clock runs, against
//! the board's, [`clock_ratio`] finds out.

pub mod clock;
pub mod clock_ratio;
pub mod increments;
pub mod resample;
pub mod streams;

use crate::sample::{Frame, ImuSample, PERIOD_US};
use crate::units::Micros;

/// The largest distance of a sample from its grid step, microseconds.
pub const TOLERANCE_US: u64 = 2_000;
/// The longest run of missing steps that keeps the grid: one second.
pub const MAX_GAP: u32 = 100;

/// The reason why a sample has no place on the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AlignError {
    /// The last sample once more.
    #[error("the sample of {} us has come twice", .at.0)]
    Duplicate {
        /// The time stamp, microseconds.
        at: Micros,
    },
    /// Time stamp before the last one.
    #[error("time goes backwards, from {} to {} us", .last.0, .at.0)]
    Backwards {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
    /// The time stamp is further than [`TOLERANCE_US`] from every grid step.
    #[error("time stamp {} us, {} us after the last one, fits no 100 Hz step", .at.0, .at.0 - .last.0)]
    OffGrid {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
    /// More than [`MAX_GAP`] steps away from the last sample, either way.
    #[error("time jumps from {} to {} us, more than 1 s", .last.0, .at.0)]
    Jump {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
}

/// The last sample that has a place on the grid, or from which the grid began again.
#[derive(Debug, Clone, Copy)]
struct Placed {
    tick: u32,
    /// The whole sample: another one of a clock that was set back may carry the same time.
    sample: ImuSample,
}

/// Puts samples on the 100 Hz grid by their own time stamps; holds where the grid stands.
#[derive(Debug, Clone, Default)]
pub struct Aligner {
    last: Option<Placed>,
}

impl Aligner {
    /// Starts before the first sample.
    pub const START: Self = Self { last: None };

    /// Places a sample on the grid.
    ///
    /// # Errors
    /// [`AlignError`]; the sample is not used. After [`AlignError::Jump`] the grid continues
    /// from that sample's time stamp, at the following tick.
    pub fn align(&mut self, sample: ImuSample) -> Result<Frame, AlignError> {
        let at = sample.time;
        let Some(placed) = &mut self.last else {
            self.last = Some(Placed { tick: 0, sample });
            return Ok(Frame { tick: 0, missing: 0, sample });
        };
        let last = placed.sample.time;
        let elapsed = at.0.abs_diff(last.0);
        if at < last {
            if elapsed > u64::from(MAX_GAP) * PERIOD_US {
                placed.sample = sample;
                return Err(AlignError::Jump { last, at });
            }
            return Err(AlignError::Backwards { last, at });
        }
        if elapsed >= (u64::from(MAX_GAP) + 1) * PERIOD_US + PERIOD_US / 2 {
            placed.sample = sample;
            return Err(AlignError::Jump { last, at });
        }
        let steps = (elapsed + PERIOD_US / 2) / PERIOD_US;
        if steps == 0 || elapsed.abs_diff(steps * PERIOD_US) > TOLERANCE_US {
            return Err(if sample == placed.sample {
                AlignError::Duplicate { at }
            } else {
                AlignError::OffGrid { last, at }
            });
        }
        let tick = placed.tick.wrapping_add(steps as u32);
        *placed = Placed { tick, sample };
        Ok(Frame { tick, missing: steps as u32 - 1, sample })
    }
}
