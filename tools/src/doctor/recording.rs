//! Reads the rows of a recording unchecked; rows that cannot be read are counted.

use crate::drive::error::DataError;
use crate::drive::foreign;
use crate::drive::recording::{Reader, Row, WHEELS, resampled};
use crate::drive::vehicle::Vehicle;
use gyronet::align::PERIODS_US;
use gyronet::sample::PERIOD_US;
use std::ops::Range;
use std::path::Path;

pub const SECOND: usize = 100;
const FIRST: usize = 1_000;
/// Most rows that are kept: a day at 100 Hz.
const MOST: usize = 8_640_000;

#[derive(Debug, Default)]
pub struct Rows {
    pub name: String,
    pub file: String,
    /// Median of the first periods, s; if it is not that of 100 Hz and is used, the rows are brought to 100 Hz.
    pub period: Option<f64>,
    pub seconds: Vec<f64>,
    /// Specific force, m/s^2, and angular rate, rad/s.
    pub force: Vec<[f64; 3]>,
    pub rate: Vec<[f64; 3]>,
    /// True yaw rate, rad/s, and course, rad.
    pub reference: Vec<Option<f64>>,
    pub course: Vec<Option<f64>>,
    /// Speed by GNSS, m/s, or else by its positions.
    pub speed: Vec<Option<f64>>,
    /// Rate of each wheel, rad/s.
    pub wheels: [Vec<Option<f64>>; WHEELS],
    /// Number of rows that were not used, and why the first one could not be read.
    pub bad: u64,
    pub first_bad: Option<String>,
    pub vehicle: Vehicle,
}

impl Rows {
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let shown = path.display().to_string();
        let file = foreign::open(path)?;
        let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or(&shown).to_owned();
        let vehicle = Vehicle::of_drive(path)?;
        let reader = Reader::new(&shown, std::io::BufReader::new(file))?.mounted(&vehicle);
        Ok(Self { vehicle, file: shown.clone(), ..Self::parse(&name, reader)? })
    }

    pub fn parse(
        name: &str,
        mut reader: impl Iterator<Item = Result<Row, DataError>>,
    ) -> Result<Self, DataError> {
        let first: Vec<_> = reader.by_ref().take(FIRST).collect();
        let times: Vec<u64> = first.iter().flatten().map(|row| row.sample.time.0).collect();
        let periods = sorted(times.windows(2).map(|pair| (pair[1] - pair[0]) as f64));
        let period = periods.get(periods.len() / 2).copied();
        let is_off = period.is_some_and(|us| us != PERIOD_US as f64 && PERIODS_US.contains(&(us as u64)));
        let reader: Box<dyn Iterator<Item = Result<Row, DataError>> + '_> = if is_off {
            Box::new(resampled(name, first.into_iter().chain(reader)))
        } else {
            Box::new(first.into_iter().chain(reader))
        };
        let mut rows = Self {
            name: name.to_owned(),
            file: format!("{name}.csv"),
            period: period.map(|us| 1e-6 * us),
            ..Self::default()
        };
        let mut start = None;
        for row in reader {
            let row = match row {
                Ok(row) if rows.seconds.len() < MOST => row,
                Ok(_) => {
                    rows.bad += 1;
                    continue;
                }
                Err(error) => {
                    rows.bad += 1;
                    rows.first_bad.get_or_insert_with(|| error.to_string());
                    continue;
                }
            };
            let time = 1e-6 * row.sample.time.0 as f64;
            rows.seconds.push(time - *start.get_or_insert(time));
            rows.force.push(row.sample.specific_force.map(|force| force.metre_per_sec2()));
            rows.rate.push(row.sample.angular_rate.map(|rate| rate.rad_per_sec()));
            rows.reference.push(row.reference);
            rows.course.push(row.course);
            let by_positions = row.heading.and_then(|heading| heading.speed).map(f64::from);
            rows.speed.push(row.speed.or(by_positions));
            for (wheel, rate) in rows.wheels.iter_mut().zip(row.wheels) {
                wheel.push(rate);
            }
        }
        Ok(rows)
    }

    pub fn len(&self) -> usize {
        self.seconds.len()
    }

    /// Returns the time and the value of each row for which `of` gives a value.
    pub fn series(&self, of: impl Fn(usize) -> Option<f64>) -> Vec<(f64, f64)> {
        (0..self.len()).filter_map(|row| Some((self.seconds[row], of(row)?))).collect()
    }

    pub fn mean_yaw_rate(&self, span: Range<usize>) -> f64 {
        let rates = &self.rate[span];
        rates.iter().map(|rate| rate[2]).sum::<f64>() / rates.len() as f64
    }
}

pub fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}
