//! Whole drives. The rows of a [`Drive`] are read from its file each time they are needed, so that a long drive takes no
//! more memory than a short one; a [`Recording`] is in memory.

use super::error::DataError;
use super::foreign;
use super::recording::{Facts, Reader, Row, Survey, name, resampled};
use super::vehicle::Vehicle;
use super::wheel_frames::{Speeds, WheelFrames};
use gyronet::mounting::GyroMap;
use gyronet::sample::PERIOD_US;
use std::borrow::Cow;
use std::fs::File;
use std::path::{Path, PathBuf};

/// The rows of a drive in order, or the fault at which they end.
pub type Rows<'a> = Box<dyn Iterator<Item = Result<Row, DataError>> + 'a>;

/// A complete drive, which can be read again and again.
#[derive(Debug, Clone)]
pub struct Drive<'a> {
    pub path: String,
    /// Contents of the vehicle file beside the drive; the rows are in the vehicle's axes.
    pub vehicle: Cow<'a, Vehicle>,
    pub facts: Facts,
    is_off_grid: bool,
    /// A map that is applied to the gyro of each row.
    pub gyro_map: Option<GyroMap>,
    /// Rows before those of the file.
    before: Vec<Row>,
    source: Source<'a>,
}

#[derive(Debug, Clone)]
enum Source<'a> {
    File(PathBuf),
    Memory(Cow<'a, [Row]>),
}

impl Drive<'static> {
    /// Reads a file and the vehicle file beside it, and checks both. What cannot be read twice (a pipe) is kept in
    /// memory.
    pub fn open(path: &Path) -> Result<Self, DataError> {
        let drive = Self::open_moving(path)?;
        drive.facts.check_rest(&drive.path)?;
        Ok(drive)
    }

    /// Opens a drive whose courses the board takes: with them it may begin in motion.
    pub fn open_with_courses(path: &Path) -> Result<Self, DataError> {
        let drive = Self::open_moving(path)?;
        if drive.facts.has_course { Ok(drive) } else { drive.facts.check_rest(&drive.path).map(|()| drive) }
    }

    /// Opens a drive that may begin in motion.
    pub fn open_moving(path: &Path) -> Result<Self, DataError> {
        let file = foreign::open(path)?;
        let again = file.metadata().is_ok_and(|metadata| metadata.is_file());
        let again = again.then(|| Source::File(path.to_owned()));
        Self::of(&path.display().to_string(), file, Vehicle::of_drive(path)?, again)
    }

    /// Reads a drive from an input, which is kept in memory unless it can be read `again`.
    fn of(
        path: &str,
        input: impl std::io::Read,
        vehicle: Vehicle,
        again: Option<Source<'static>>,
    ) -> Result<Self, DataError> {
        let (mut survey, mut kept) = (Survey::default(), Vec::new());
        for row in Reader::new(path, input)?.mounted(&vehicle) {
            let row = row?;
            survey.row(&row);
            if again.is_none() {
                kept.push(row);
            }
        }
        let facts = survey.finish(path)?;
        let source = again.unwrap_or(Source::Memory(Cow::Owned(kept)));
        let (vehicle, before, is_off_grid) = (Cow::Owned(vehicle), Vec::new(), facts.is_off_grid);
        let path = path.to_owned();
        let mut drive = Self { path, vehicle, facts, is_off_grid, gyro_map: None, before, source };
        if is_off_grid {
            let mut survey = Survey::default();
            drive.facts.reference_bias = None;
            for row in drive.rows()? {
                survey.row(&row?);
            }
            drive.facts = survey.finish(&drive.path)?;
        }
        Ok(drive)
    }
}

/// A complete drive in memory; [`Drive`] is for drives of any length.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    pub path: String,
    pub rows: Vec<Row>,
    /// Number of rows that are missing in gaps.
    pub missing: u64,
    /// Contents of the vehicle file beside the recording; the rows are in the vehicle's axes.
    pub vehicle: Vehicle,
}

impl Recording {
    /// Reads a file, and the vehicle file beside it.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let name = path.display().to_string();
        Self::of(&name, foreign::open(path)?, Vehicle::of_drive(path)?)
    }

    pub fn parse(path: &str, input: impl std::io::Read) -> Result<Self, DataError> {
        Self::of(path, input, Vehicle::default())
    }

    fn of(path: &str, input: impl std::io::Read, vehicle: Vehicle) -> Result<Self, DataError> {
        let drive = Drive::of(path, input, vehicle, None)?;
        drive.facts.check_rest(path)?;
        let (rows, missing) = (drive.rows()?.collect::<Result<_, _>>()?, drive.facts.missing);
        Ok(Self { path: path.to_owned(), rows, missing, vehicle: drive.vehicle.into_owned() })
    }

    pub fn facts(&self) -> Facts {
        Facts::of(&self.rows)
    }

    /// The wheels of the vehicle's bus, as the recording has them.
    pub fn wheels(&self) -> Option<WheelFrames> {
        WheelFrames::of(self.facts().wheels, self.vehicle.radius_m())
    }

    pub fn name(&self) -> &str {
        name(&self.path)
    }
}

impl<'a> From<&'a Recording> for Drive<'a> {
    fn from(recording: &'a Recording) -> Self {
        Self {
            path: recording.path.clone(),
            vehicle: Cow::Borrowed(&recording.vehicle),
            facts: recording.facts(),
            is_off_grid: false,
            gyro_map: None,
            before: Vec::new(),
            source: Source::Memory(Cow::Borrowed(&recording.rows)),
        }
    }
}

impl<'a> Drive<'a> {
    /// The drive with these rows before its own, which come later by as much.
    pub fn after(&self, before: Vec<Row>) -> Drive<'a> {
        Drive { before, ..self.clone() }
    }
}

impl Drive<'_> {
    pub fn rows(&self) -> Result<Rows<'_>, DataError> {
        let rows: Rows<'_> = match &self.source {
            Source::Memory(rows) => Box::new(rows.iter().copied().map(Ok)),
            Source::File(path) => {
                let file = File::open(path).map_err(|source| DataError::of(&self.path, source.into()))?;
                Box::new(Reader::new(&self.path, file)?.mounted(&self.vehicle))
            }
        };
        let rows: Rows<'_> = if self.is_off_grid { Box::new(resampled(&self.path, rows)) } else { rows };
        let bias = self.facts.reference_bias.unwrap_or_default();
        let (map, later) = (self.gyro_map, self.before.len() as u64 * PERIOD_US);
        let placed = rows.map(move |row| {
            row.map(|mut row| {
                row.sample.time.0 += later;
                row.reference = row.reference.map(|rate| rate - bias);
                if let Some(map) = map {
                    row.sample.angular_rate = map.rate(row.sample.angular_rate);
                }
                row
            })
        });
        Ok(Box::new(self.before.iter().copied().map(Ok).chain(placed)))
    }

    pub fn name(&self) -> &str {
        name(&self.path)
    }

    /// The wheels of the vehicle's bus, as the drive has them.
    pub fn wheels(&self) -> Option<WheelFrames> {
        WheelFrames::of(self.facts.wheels, self.vehicle.radius_m())
    }

    pub fn speeds(&self) -> Option<Speeds> {
        Speeds::of(self.facts.wheels, self.vehicle.radius_m())
    }
}
