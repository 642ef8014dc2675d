//! Translates the time stamps of a part's clock, which started at another time and has another speed, to the board's.
//!
//! The board's clock times the arrival, but with a varying delay. The arrival with the least delay is the best one,
//! so:
//!
//! | event | rule |
//! |---|---|
//! | first sample | offset = arrival - time stamp |
//! | earlier than the offset predicts | the offset is lowered to it at once |
//! | later, within [`JUMP_US`] (jitter) | the offset creeps up, [`CREEP_PPM`] of the time passed |
//! | later than [`JITTER_US`] throughout [`PATIENCE_US`] (a small jump) | as a clock jump |
//! | time stamp equal to the last, or before it within [`JUMP_US`] | refused |
//! | off by more than [`JUMP_US`] (clock jump, restart, lost messages) | new offset; the caller must not connect samples across it |
//!
//! The board's time never goes back: after the offset was lowered it advances by 1 us a sample until it is correct
//! again.

use crate::units::Micros;

/// A time stamp that is off by more than this counts as a clock jump.
pub const JUMP_US: u64 = 100_000;
/// The rate at which the offset may grow: that of two poor crystals.
pub const CREEP_PPM: u64 = 200;
/// The time for which arrivals may all be late before the clock counts as having jumped.
pub const PATIENCE_US: u64 = 1_000_000;
pub const JITTER_US: u64 = 2_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum ClockError {
    #[error("two samples carry the time stamp {} us", .at.0)]
    Duplicate { at: Micros },
    #[error("a sample of {} us arrived after one of {} us", .at.0, .last.0)]
    OutOfOrder { last: Micros, at: Micros },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardTime {
    /// The time at which the sample was taken, plus the shortest delay of the line.
    pub time: Micros,
    pub jumped: bool,
}

#[derive(Debug, Clone, Default)]
pub struct PartClock {
    /// Last time stamp, its board time, and board minus part time, all microseconds.
    last: Option<(Micros, Micros, i64)>,
    /// The first arrival of the current run of late ones.
    late_since: Option<Micros>,
}

impl PartClock {
    pub const START: Self = Self { last: None, late_since: None };

    pub fn translate(&mut self, stamp: Micros, arrival: Micros) -> Result<BoardTime, ClockError> {
        let measured = (arrival.0 as i64).wrapping_sub(stamp.0 as i64);
        let Some((last, board, offset)) = self.last else {
            return Ok(self.take(stamp, arrival, measured, false));
        };
        if stamp == last {
            return Err(ClockError::Duplicate { at: stamp });
        }
        let late = measured.wrapping_sub(offset);
        let since = if late > JITTER_US as i64 { self.late_since.or(Some(arrival)) } else { None };
        self.late_since = since;
        let lasting = since.is_some_and(|since| arrival.0.saturating_sub(since.0) > PATIENCE_US);
        if lasting || late.unsigned_abs() > JUMP_US {
            self.late_since = None;
            let time = Micros(arrival.0.max(board.0 + 1));
            return Ok(self.take(stamp, time, measured, true));
        }
        if stamp < last {
            return Err(ClockError::OutOfOrder { last, at: stamp });
        }
        let creep = (stamp.0 - last.0).saturating_mul(CREEP_PPM).div_ceil(1_000_000) as i64;
        let offset = offset.wrapping_add(late.min(creep));
        let time = Micros(stamp.0.wrapping_add_signed(offset).max(board.0 + 1));
        Ok(self.take(stamp, time, offset, false))
    }

    fn take(&mut self, stamp: Micros, time: Micros, offset: i64, jumped: bool) -> BoardTime {
        self.last = Some((stamp, time, offset));
        BoardTime { time, jumped }
    }
}
