//! Time stamps onto the common 100 Hz grid.
//!
//! The rule: the first sample sets the grid. A later one belongs to the step nearest to its
//! time stamp, and must come within [`TOLERANCE_US`] of it; the grid then follows the sample,
//! so that a clock which is slow or fast by some percent never runs out of step. A sample that
//! is a duplicate, older than the last one or off the grid is an error and leaves the grid as
//! it was. A jump of more than a second either way (a part that restarted, a cable that came
//! back) is an error too, and the grid is laid anew from there: no wait without a bound.
//!
//! That is for one stream that comes at 100 Hz by itself, by the part's own clock. Streams of
//! other rates, and two or more parts with a clock each, go through [`streams`] first: it takes
//! the parts' clocks to the board's ([`clock`]), interpolates ([`resample`]) and sums
//! ([`increments`]), and its samples lie on the grid.

pub mod clock;
pub mod increments;
pub mod resample;
pub mod streams;

use crate::sample::{Frame, ImuSample, PERIOD_US};
use crate::units::Micros;

/// How far from its grid step a sample may be, microseconds.
pub const TOLERANCE_US: u64 = 2_000;
/// The longest run of missing steps that keeps the grid: one second.
pub const MAX_GAP: u32 = 100;

/// Why a sample found no place on the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AlignError {
    /// Time stamp equal to the last one.
    Duplicate {
        /// The time stamp, microseconds.
        at: Micros,
    },
    /// Time stamp before the last one.
    Backwards {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
    /// Not within [`TOLERANCE_US`] of any grid step.
    OffGrid {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
    /// More than [`MAX_GAP`] steps away from the last sample, either way.
    Jump {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
}

impl core::fmt::Display for AlignError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Duplicate { at } => write!(f, "two samples carry the time stamp {} us", at.0),
            Self::Backwards { last, at } => {
                write!(f, "time goes backwards, from {} to {} us", last.0, at.0)
            }
            Self::OffGrid { last, at } => write!(
                f,
                "time stamp {} us, {} us after the last one, fits no 100 Hz step",
                at.0,
                at.0 - last.0
            ),
            Self::Jump { last, at } => {
                write!(f, "time jumps from {} to {} us, more than 1 s", last.0, at.0)
            }
        }
    }
}

impl core::error::Error for AlignError {}

/// Puts samples on the 100 Hz grid by their own time stamps; holds where the grid stands.
#[derive(Debug, Clone, Default)]
pub struct Aligner {
    last: Option<(Micros, u32)>,
}

impl Aligner {
    /// Places one sample.
    ///
    /// # Errors
    /// [`AlignError`]; the sample is not used. After [`AlignError::Jump`] the grid continues
    /// from that sample's time stamp, at the following tick.
    pub fn process(&mut self, sample: ImuSample) -> Result<Frame, AlignError> {
        let Some((last, tick)) = self.last else {
            self.last = Some((sample.time, 0));
            return Ok(Frame { tick: 0, missing: 0, sample });
        };
        let at = sample.time;
        if at == last {
            return Err(AlignError::Duplicate { at });
        }
        if at < last {
            if last.0 - at.0 > u64::from(MAX_GAP) * PERIOD_US {
                self.last = Some((at, tick));
                return Err(AlignError::Jump { last, at });
            }
            return Err(AlignError::Backwards { last, at });
        }
        let elapsed = at.0 - last.0;
        if elapsed >= (u64::from(MAX_GAP) + 1) * PERIOD_US + PERIOD_US / 2 {
            self.last = Some((at, tick));
            return Err(AlignError::Jump { last, at });
        }
        let steps = (elapsed + PERIOD_US / 2) / PERIOD_US;
        if steps == 0 || elapsed.abs_diff(steps * PERIOD_US) > TOLERANCE_US {
            return Err(AlignError::OffGrid { last, at });
        }
        let tick = tick.wrapping_add(steps as u32);
        self.last = Some((at, tick));
        Ok(Frame { tick, missing: steps as u32 - 1, sample })
    }
}
