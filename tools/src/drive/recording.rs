//! A recorded drive is a CSV file with a header and one row for each 10 ms.
//!
//! Columns are found by name, in any order; unknown columns are skipped.
//!
//! | column | unit | |
//! |---|---|---|
//! | `t_s` | s | device time, rising |
//! | `acc_x`, `acc_y`, `acc_z` | m/s^2 | specific force: x forward, y left, z up |
//! | `gyr_x`, `gyr_y`, `gyr_z` | rad/s | angular rate |
//! | `ref_gyr_z` | rad/s | optional: the true yaw rate; empty if unknown |
//! | `ref_yaw` | rad | optional: the true course, to the left; empty if unknown |
//! | `wheel1_rate` .. `wheel4_rate` | rad/s | optional: rate of a wheel; empty if not recorded |
//!
//! Values are converted to the codes of [`gyronet::units`] through f32, and times through 10 kHz ticks, as the sensor
//! sends them. So a recording read here and the same recording parsed from MTData2 bytes are bit-identical samples.

mod reader;

pub use reader::Reader;

use crate::drive::error::{DataError, DataFault};
use crate::drive::vehicle::Vehicle;
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::{ImuSample, PERIOD_US, RATE_HZ};
use std::fs::File;
use std::path::Path;

/// Number of wheel columns of a recording.
pub const WHEELS: usize = 4;
/// Largest mean rate of a standing wheel over a second, rad/s. A rate sensor on a standing wheel reads up to 0.04.
pub const WHEEL_STANDS: f64 = 0.3;
/// Largest difference of the median sample period from 10 ms, microseconds.
const PERIOD_TOLERANCE_US: u64 = 2_000;
/// Rows of the beginning that [`Recording::check`] keeps in memory: ten seconds.
const BEGINNING: usize = 1_000;

/// One row of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Line number in the file; the header is line 1.
    pub line: u64,
    /// The sample of the sensor.
    pub sample: ImuSample,
    /// The true yaw rate, rad/s.
    pub reference: Option<f64>,
    /// The true course, rad, positive to the left, from any zero direction, wrapped or not.
    pub course: Option<f64>,
    /// Rates of the wheels, rad/s.
    pub wheels: [Option<f64>; WHEELS],
}

/// A complete drive that can be replayed: at least 3 s long, at 100 Hz, with any wheels at rest in the first 3 s.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The path of the file, for messages.
    pub path: String,
    /// The rows in order of time.
    pub rows: Vec<Row>,
    /// Number of rows that are missing in gaps.
    pub missing: u64,
    /// Contents of the vehicle file beside the recording; the rows are in the vehicle's axes.
    pub vehicle: Vehicle,
}

impl Recording {
    /// Reads a file, and the vehicle file beside it.
    ///
    /// # Errors
    /// [`DataError`], which names the file and, where there is one, the line.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|source| DataError::of(&name, source.into()))?;
        Self::of(&name, file, Vehicle::of_drive(path)?)
    }

    /// Checks a file of any length; only its beginning is kept in memory.
    ///
    /// # Errors
    /// As [`Recording::read`].
    pub fn check(path: &Path) -> Result<(), DataError> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|source| DataError::of(&name, source.into()))?;
        let vehicle = Vehicle::of_drive(path)?;
        let mut rows = Reader::new(&name, file)?.mounted(&vehicle);
        let beginning = rows.by_ref().take(BEGINNING).collect::<Result<Vec<Row>, _>>()?;
        Self { path: name, rows: beginning, missing: 0, vehicle }.checked()?;
        rows.try_for_each(|row| row.map(drop))
    }

    /// Parses a recording from any reader; `path` is its name in errors.
    ///
    /// # Errors
    /// [`DataError`] with that path.
    pub fn parse(path: &str, input: impl std::io::Read) -> Result<Self, DataError> {
        Self::of(path, input, Vehicle::default())
    }

    fn of(path: &str, input: impl std::io::Read, vehicle: Vehicle) -> Result<Self, DataError> {
        let rows = Reader::new(path, input)?.mounted(&vehicle).collect::<Result<Vec<Row>, _>>()?;
        let mut recording = Self { path: path.to_owned(), rows, missing: 0, vehicle }.checked()?;
        recording.missing = recording
            .periods()
            .map(|us| (us + PERIOD_US / 2) / PERIOD_US)
            .fold(0, |missing, steps| missing + steps.saturating_sub(1));
        Ok(recording)
    }

    /// Returns the file's name without folder and extension, for tables.
    #[must_use]
    pub fn name(&self) -> &str {
        Path::new(&self.path).file_stem().and_then(|stem| stem.to_str()).unwrap_or(&self.path)
    }

    /// Returns the time from the first sample to the end of the last one, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        let [first, last] =
            [self.rows.first(), self.rows.last()].map(|row| row.map_or(0, |row| row.sample.time.0));
        (last - first + PERIOD_US) as f64 * 1e-6
    }

    /// Returns the times between neighbouring rows, microseconds.
    fn periods(&self) -> impl Iterator<Item = u64> {
        self.rows.windows(2).map(|pair| pair[1].sample.time.0 - pair[0].sample.time.0)
    }

    fn checked(self) -> Result<Self, DataError> {
        self.check_length()?;
        self.check_period()?;
        self.check_wheels()?;
        Ok(self)
    }

    fn check_length(&self) -> Result<(), DataError> {
        if self.rows.is_empty() {
            return Err(DataError::of(&self.path, DataFault::Empty));
        }
        let seconds = self.seconds();
        let needed = f64::from(STATIC_SAMPLES) / f64::from(RATE_HZ);
        if seconds < needed {
            return Err(DataError::of(&self.path, DataFault::TooShort { seconds, needed }));
        }
        Ok(())
    }

    fn check_period(&self) -> Result<(), DataError> {
        let mut periods: Vec<u64> = self.periods().collect();
        periods.sort_unstable();
        let Some(median) = periods.get(periods.len() / 2) else { return Ok(()) };
        if median.abs_diff(PERIOD_US) > PERIOD_TOLERANCE_US {
            return Err(DataError::of(&self.path, DataFault::Rate { hz: 1e6 / *median as f64 }));
        }
        Ok(())
    }

    /// Checks that the wheels stand in each of the first three seconds. Each second is checked on its own, so that a
    /// car that pulls away in the last one is found.
    fn check_wheels(&self) -> Result<(), DataError> {
        let still = self.rows.get(..STATIC_SAMPLES as usize).unwrap_or(&self.rows);
        for second in still.chunks(RATE_HZ as usize) {
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
                return Err(DataError::of(&self.path, fault));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
