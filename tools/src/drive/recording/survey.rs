//! The first reading of a drive: it checks the drive as a whole, and notes what a replay must know before its first
//! row.

use super::rest::Rest;
use super::{Row, WHEELS};
use crate::drive::error::{DataError, DataFault, Turning};
use gyronet::align::{PERIODS_US, SNAP_US};
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::{PERIOD_US, RATE_HZ};
use gyronet::units::Micros;
use std::collections::BTreeMap;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Facts {
    pub rows: usize,
    pub first: Micros,
    pub last: Micros,
    /// Number of rows that are missing in gaps.
    pub missing: u64,
    pub is_off_grid: bool,
    /// True if each wheel is recorded in any row.
    pub wheels: [bool; WHEELS],
    /// True if any row has a reference yaw rate, and a course for the board.
    pub has_rate: bool,
    pub has_course: bool,
    /// The wheel that turns during static initialisation.
    pub turning: Option<Turning>,
    /// Bias of the reference yaw rate, rad/s: its mean over the rest at the start, if wheels show that rest.
    pub reference_bias: Option<f64>,
}

impl Facts {
    /// The content of these rows, whether they can be replayed or not.
    pub fn of(rows: &[Row]) -> Self {
        let mut survey = Survey::of(rows);
        Self { turning: survey.rest.turning(), ..survey.facts }
    }

    /// Time from the first sample to the end of the last one, s.
    pub fn seconds(&self) -> f64 {
        (self.last.0 - self.first.0 + PERIOD_US) as f64 * 1e-6
    }

    /// Fails if a wheel turns during static initialisation.
    pub fn check_rest(&self, path: &str) -> Result<(), DataError> {
        self.turning.map_or(Ok(()), |turning| Err(DataError::of(path, DataFault::Moving(turning))))
    }

    pub fn has_wheels(&self) -> bool {
        self.wheels.contains(&true)
    }
}

#[derive(Debug, Default)]
pub struct Survey {
    facts: Facts,
    rest: Rest,
    /// How often each sample period occurs. Different periods add up to the length of the drive, so their number grows
    /// with its square root at most.
    periods: BTreeMap<u64, u64>,
}

impl Survey {
    pub fn of(rows: &[Row]) -> Self {
        let mut survey = Self::default();
        rows.iter().for_each(|row| survey.row(row));
        survey
    }

    pub fn row(&mut self, row: &Row) {
        let (facts, time) = (&mut self.facts, row.sample.time);
        if facts.rows == 0 {
            facts.first = time;
        } else {
            let period = time.0 - facts.last.0;
            *self.periods.entry(period).or_default() += 1;
            let beyond = (time.0 - facts.first.0) % PERIOD_US;
            facts.is_off_grid |= beyond.min(PERIOD_US - beyond) > SNAP_US;
            facts.missing += ((period + PERIOD_US / 2) / PERIOD_US).saturating_sub(1);
        }
        facts.last = time;
        facts.rows += 1;
        facts.has_rate |= row.reference.is_some();
        facts.has_course |= row.heading.is_some();
        for (recorded, rate) in facts.wheels.iter_mut().zip(row.wheels) {
            *recorded |= rate.is_some();
        }
        self.rest.row(row);
    }

    /// Checks that the drive can be replayed, from a rest or in motion: at least 3 s long, at 50 to 1000 Hz.
    pub fn finish(mut self, path: &str) -> Result<Facts, DataError> {
        if self.facts.rows == 0 {
            return Err(DataError::of(path, DataFault::Empty));
        }
        let (seconds, needed) = (self.facts.seconds(), f64::from(STATIC_SAMPLES) / f64::from(RATE_HZ));
        if seconds < needed {
            return Err(DataError::of(path, DataFault::TooShort { seconds, needed }));
        }
        let median = self.median_period().unwrap_or(PERIOD_US);
        if !PERIODS_US.contains(&median) {
            return Err(DataError::of(path, DataFault::Rate { hz: 1e6 / median as f64 }));
        }
        self.facts.is_off_grid |= median.abs_diff(PERIOD_US) > SNAP_US;
        self.facts.turning = self.rest.turning();
        self.facts.reference_bias = self.rest.reference_bias();
        Ok(self.facts)
    }

    fn median_period(&self) -> Option<u64> {
        let middle = self.periods.values().sum::<u64>() / 2;
        let mut shorter = 0;
        let found = self.periods.iter().find(|(_, count)| {
            shorter += **count;
            shorter > middle
        });
        found.map(|(period, _)| *period)
    }
}
