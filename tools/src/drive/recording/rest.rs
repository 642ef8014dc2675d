//! The rest at the start of a drive: it must last as long as static initialisation, and it shows the bias of a
//! reference rate.

use super::{Row, WHEEL_STANDS, WHEELS};
use crate::drive::error::Turning;
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::RATE_HZ;

/// Rows of a second, and the seconds of static initialisation.
const SECOND: usize = RATE_HZ as usize;
const NEEDED: usize = STATIC_SAMPLES as usize / SECOND;
/// Longest rest that is taken for the bias, s.
const LONGEST: usize = 600;

/// The seconds from the start of a drive in which the wheels stand. Each is checked on its own, so that a car that pulls
/// away in the last one of static initialisation is found.
#[derive(Debug, Default)]
pub struct Rest {
    rows: Vec<Row>,
    /// Mean of the reference yaw rate in each second, rad/s, where it and a wheel are known.
    references: Vec<Option<f64>>,
    /// The wheel that ended the rest, if its mean shows that it turned.
    turning: Option<Turning>,
    is_over: bool,
}

impl Rest {
    pub fn row(&mut self, row: &Row) {
        if !self.is_over {
            self.rows.push(*row);
            if self.rows.len() == SECOND {
                self.second();
            }
        }
    }

    fn second(&mut self) {
        self.turning = turning(&self.rows);
        let known = |row: &Row| row.wheels.iter().any(Option::is_some).then_some(row.reference).flatten();
        let sum = self.rows.iter().map(known).sum::<Option<f64>>();
        let moves = |row: &Row| row.wheels.iter().flatten().any(|rate| rate.abs() > WHEEL_STANDS);
        self.is_over = self.turning.is_some()
            || self.references.len() == LONGEST
            || self.references.len() >= NEEDED && self.rows.iter().any(moves);
        if !self.is_over {
            self.references.push(sum.map(|sum| sum / self.rows.len() as f64));
        }
        self.rows.clear();
    }

    /// The wheel that turns during static initialisation.
    pub fn turning(&mut self) -> Option<Turning> {
        if self.references.len() < NEEDED && !self.is_over {
            self.second();
        }
        self.turning.filter(|_| self.references.len() < NEEDED)
    }

    /// Mean of the reference over the rest, rad/s, if it lasts as long as static initialisation. The last second is left
    /// out of a longer one, because wheels may be reported late.
    pub fn reference_bias(&self) -> Option<f64> {
        let seconds = self.references.get(..NEEDED.max(self.references.len().saturating_sub(1)))?;
        Some(seconds.iter().copied().sum::<Option<f64>>()? / seconds.len() as f64)
    }
}

/// Returns the first wheel whose mean rate is not that of a standing one.
fn turning(second: &[Row]) -> Option<Turning> {
    (0..WHEELS).find_map(|wheel| {
        let rates = || second.iter().filter_map(|row| row.wheels[wheel]);
        let rate = rates().sum::<f64>() / rates().count().max(1) as f64;
        let turns = |row: &&Row| row.wheels[wheel].is_some_and(|rate| rate.abs() > WHEEL_STANDS);
        // At least one rate is above the limit, since the mean is.
        let line = second.iter().find(turns).map_or(0, |row| row.line);
        (rate.abs() > WHEEL_STANDS).then_some(Turning { line, wheel: wheel + 1, rate })
    })
}
