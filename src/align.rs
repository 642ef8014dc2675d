//! Assigns each sample to a step of the common 100 Hz grid by its time stamp.
//!
//! The first sample sets the grid. A later sample belongs to the step nearest to its time stamp, and must lie within
//! [`TOLERANCE_US`] of that step. The grid then follows the sample, so a clock that is some percent slow or fast
//! never runs out of step. A duplicate, a sample older than the last one and a sample off the grid are errors and
//! leave the grid unchanged. A jump of more than a second either way (a part that restarted, a cable that was
//! reconnected) is an error too, but the grid restarts there: no wait is unbounded.
//!
//! This is for the inertial sensor, at 100 Hz and paced by its own clock; [`clock_ratio`] measures how fast that clock
//! runs against the board's. A fibre-optic gyro has another clock and another rate: [`fog_grid`] converts its time
//! stamps to the board's clock ([`clock`]) and sums its increments over the steps of a grid ([`increments`]).

pub mod clock;
pub mod clock_ratio;
pub mod fog_grid;
pub mod increments;

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
    /// The sample repeats the last one.
    #[error("duplicate sample at {} us", .at.0)]
    Duplicate {
        /// The time stamp, microseconds.
        at: Micros,
    },
    /// The time stamp is before the last one.
    #[error("time goes backwards, from {} to {} us", .last.0, .at.0)]
    Backwards {
        /// The last time stamp.
        last: Micros,
        /// The time stamp of the refused sample.
        at: Micros,
    },
    /// The time stamp is further than [`TOLERANCE_US`] from every grid step.
    #[error("time stamp {} us, {} us after the last one, fits no 100 Hz step", .at.0, .at.0 - .last.0)]
    OffGrid {
        /// The last time stamp.
        last: Micros,
        /// The time stamp of the refused sample.
        at: Micros,
    },
    /// The time stamp is more than [`MAX_GAP`] steps from the last one, either way.
    #[error("time jumps from {} to {} us, more than 1 s", .last.0, .at.0)]
    Jump {
        /// The last time stamp.
        last: Micros,
        /// The time stamp of the refused sample.
        at: Micros,
    },
}

/// The last sample on the grid, or the one at which the grid restarted.
#[derive(Debug, Clone, Copy)]
struct Placed {
    tick: u32,
    /// The complete sample, because after a clock was set back another sample may carry the same time.
    sample: ImuSample,
}

/// Places samples on the 100 Hz grid by their time stamps, and holds the current step of the grid.
#[derive(Debug, Clone, Default)]
pub struct Aligner {
    last: Option<Placed>,
}

impl Aligner {
    /// The state before the first sample.
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
