//! This module translates the time stamps of a part's clock to the board's clock.
//!
//! A time stamp says when a reading was taken, by a clock that started at another time and
//! runs at another speed than the board's. Its arrival is by the board's clock, but late by a
//! time that varies. The least late arrival is the best one, so:
//!
//! | event | rule |
//! |---|---|
//! | first sample | offset = arrival - time stamp |
//! | earlier than the offset says | the offset goes down to it at once |
//! | later, within [`JUMP_US`] (jitter) | the offset creeps up, [`CREEP_PPM`] of the time passed; counted above [`JITTER_US`] |
//! | never less late than [`JITTER_US`] for [`PATIENCE_US`] (a small jump) | as a clock jump |
//! | time stamp equal to the last (duplicate) | refused, counted |
//! | before the last, within [`JUMP_US`] (out of order) | refused, counted |
//! | off by more than [`JUMP_US`] (clock jump, restart, lost messages that nothing counted) | new offset, counted, and the caller connects nothing across it |
//!
//! The board's time never goes back: where the offset has gone down, it stands still for a
//! microsecond a sample until it is right again.

use crate::health::count;
use crate::units::Micros;

/// A time stamp that is off by more than this is another clock's.
pub const JUMP_US: u64 = 100_000;
/// The rate at which the offset may grow: that of two poor crystals.
pub const CREEP_PPM: u64 = 200;
/// The time for which arrivals may all be late before the clock counts as having jumped.
pub const PATIENCE_US: u64 = 1_000_000;
/// Arrivals later than this are counted.
pub const JITTER_US: u64 = 2_000;

/// The reason why a time stamp has no place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ClockError {
    /// Time stamp equal to the last one.
    #[error("two samples carry the time stamp {} us", .at.0)]
    Duplicate {
        /// The time stamp.
        at: Micros,
    },
    /// Time stamp before the last one.
    #[error("a sample of {} us comes after one of {} us", .at.0, .last.0)]
    OutOfOrder {
        /// The last time stamp.
        last: Micros,
        /// This one.
        at: Micros,
    },
}

/// The numbers of events. They saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ClockCounters {
    /// Samples taken.
    pub samples: u32,
    /// Samples that came later than [`JITTER_US`] after the least late one.
    pub late: u32,
    /// Time stamps that came twice.
    pub duplicates: u32,
    /// Samples that came after a later one.
    pub out_of_order: u32,
    /// Clock jumps.
    pub jumps: u32,
}

impl ClockCounters {
    /// Starts without an event.
    pub const NONE: Self = Self { samples: 0, late: 0, duplicates: 0, out_of_order: 0, jumps: 0 };

    /// Returns the events since `before`.
    #[must_use]
    pub const fn since(&self, before: &Self) -> Self {
        Self {
            samples: self.samples.wrapping_sub(before.samples),
            late: self.late.wrapping_sub(before.late),
            duplicates: self.duplicates.wrapping_sub(before.duplicates),
            out_of_order: self.out_of_order.wrapping_sub(before.out_of_order),
            jumps: self.jumps.wrapping_sub(before.jumps),
        }
    }
}

/// Gives a sample's time by the board's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoardTime {
    /// The time at which the sample was taken, plus the shortest delay of the line.
    pub time: Micros,
    /// The part's clock has jumped: what came before is not connected to this sample.
    pub jumped: bool,
}

/// Translates a part's clock to the board's.
#[derive(Debug, Clone, Default)]
pub struct PartClock {
    /// Last time stamp, its board time, and board minus part time, all microseconds.
    last: Option<(Micros, Micros, i64)>,
    /// The first of the arrivals that have all been late.
    late_since: Option<Micros>,
    counters: ClockCounters,
}

impl PartClock {
    /// Starts before the first sample.
    pub const START: Self = Self { last: None, late_since: None, counters: ClockCounters::NONE };

    /// Takes a sample's time stamp and when it arrived.
    ///
    /// # Errors
    /// [`ClockError`]: the sample is not to be used.
    pub fn translate(&mut self, stamp: Micros, arrival: Micros) -> Result<BoardTime, ClockError> {
        let measured = (arrival.0 as i64).wrapping_sub(stamp.0 as i64);
        let Some((last, board, offset)) = self.last else {
            return Ok(self.take(stamp, arrival, measured, false));
        };
        if stamp == last {
            count(&mut self.counters.duplicates, 1);
            return Err(ClockError::Duplicate { at: stamp });
        }
        let late = measured.wrapping_sub(offset);
        let since = if late > JITTER_US as i64 { self.late_since.or(Some(arrival)) } else { None };
        self.late_since = since;
        let lasting = since.is_some_and(|since| arrival.0.saturating_sub(since.0) > PATIENCE_US);
        if lasting || late.unsigned_abs() > JUMP_US {
            count(&mut self.counters.jumps, 1);
            self.late_since = None;
            let time = Micros(arrival.0.max(board.0 + 1));
            return Ok(self.take(stamp, time, measured, true));
        }
        if stamp < last {
            count(&mut self.counters.out_of_order, 1);
            return Err(ClockError::OutOfOrder { last, at: stamp });
        }
        count(&mut self.counters.late, u32::from(late > JITTER_US as i64));
        let creep = (stamp.0 - last.0).saturating_mul(CREEP_PPM).div_ceil(1_000_000) as i64;
        let offset = offset.wrapping_add(late.min(creep));
        let time = Micros(stamp.0.wrapping_add_signed(offset).max(board.0 + 1));
        Ok(self.take(stamp, time, offset, false))
    }

    /// Returns the event counters since the start.
    #[must_use]
    pub fn counters(&self) -> &ClockCounters {
        &self.counters
    }

    fn take(&mut self, stamp: Micros, time: Micros, offset: i64, jumped: bool) -> BoardTime {
        count(&mut self.counters.samples, 1);
        self.last = Some((stamp, time, offset));
        BoardTime { time, jumped }
    }
}
