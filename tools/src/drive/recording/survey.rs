//! The first reading of a drive: it checks the drive as a whole, and notes what a replay must know before its first
//! row.

use super::{Row, WHEEL_STANDS, WHEELS};
use crate::drive::error::{DataError, DataFault};
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
    /// True if the rows are not 10 ms apart.
    pub is_off_grid: bool,
    /// True if each wheel is recorded in any row.
    pub wheels: [bool; WHEELS],
    /// True if any row has a reference yaw rate, and a course for the board.
    pub has_rate: bool,
    pub has_course: bool,
}

impl Facts {
    /// The content of these rows, whether they can be replayed or not.
    pub fn of(rows: &[Row]) -> Self {
        Survey::of(rows).facts
    }

    /// Time from the first sample to the end of the last one, s.
    pub fn seconds(&self) -> f64 {
        (self.last.0 - self.first.0 + PERIOD_US) as f64 * 1e-6
    }

    pub fn has_wheels(&self) -> bool {
        self.wheels.contains(&true)
    }
}

#[derive(Debug, Default)]
pub struct Survey {
    facts: Facts,
    /// The rows of static initialisation, in which the wheels must stand.
    beginning: Vec<Row>,
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
        if self.beginning.len() < STATIC_SAMPLES as usize {
            self.beginning.push(*row);
        }
    }

    /// Checks that the drive can be replayed: at least 3 s long, at 50 to 1000 Hz, with any wheels at rest in the first 3 s.
    pub fn finish(mut self, path: &str) -> Result<Facts, DataError> {
        let beginning = std::mem::take(&mut self.beginning);
        let facts = self.finish_moving(path)?;
        check_wheels(&beginning, path)?;
        Ok(facts)
    }

    /// As [`Survey::finish`]; where courses start the vehicle its wheels may turn.
    pub fn finish_with_courses(self, path: &str) -> Result<Facts, DataError> {
        if self.facts.has_course { self.finish_moving(path) } else { self.finish(path) }
    }

    /// As [`Survey::finish`], with wheels that may turn.
    pub fn finish_moving(mut self, path: &str) -> Result<Facts, DataError> {
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

/// Checks that the wheels stand in each of the first three seconds. Each second is checked on its own, so that a
/// car that pulls away in the last one is found.
fn check_wheels(beginning: &[Row], path: &str) -> Result<(), DataError> {
    for second in beginning.chunks(RATE_HZ as usize) {
        for wheel in 0..WHEELS {
            let rates = || second.iter().filter_map(|row| row.wheels[wheel]);
            let mean = rates().sum::<f64>() / rates().count().max(1) as f64;
            if mean.abs() <= WHEEL_STANDS {
                continue;
            }
            let turns = |row: &&Row| row.wheels[wheel].is_some_and(|rate| rate.abs() > WHEEL_STANDS);
            // At least one rate is above the limit, since the mean is.
            let line = second.iter().find(turns).map_or(0, |row| row.line);
            let fault = DataFault::Moving { line, wheel: wheel + 1, rate: mean };
            return Err(DataError::of(path, fault));
        }
    }
    Ok(())
}
