//! The errors of recorded drives and of data sets. They name the file and, if known, the line and the column.

use std::fmt;

/// An error in a file: where it is, and what is wrong.
#[derive(Debug)]
pub struct DataError {
    /// The path of the file or folder.
    pub path: String,
    /// The line number, from 1.
    pub line: Option<u64>,
    /// The name or the number of the column.
    pub column: Option<String>,
    pub fault: DataFault,
}

impl DataError {
    /// Returns an error that concerns a whole file.
    pub fn of(path: impl fmt::Display, fault: DataFault) -> Self {
        Self { path: path.to_string(), line: None, column: None, fault }
    }

    pub fn at(path: impl fmt::Display, line: u64, fault: DataFault) -> Self {
        Self { line: Some(line), ..Self::of(path, fault) }
    }

    /// Returns an error that concerns one field.
    pub fn value(
        path: impl fmt::Display,
        line: u64,
        column: impl fmt::Display,
        text: &str,
        error: ValueError,
    ) -> Self {
        let fault = DataFault::Value { text: text.to_owned(), error };
        Self { column: Some(column.to_string()), ..Self::at(path, line, fault) }
    }

    /// Returns the error of a file that cannot be opened.
    pub fn open(path: impl fmt::Display, source: std::io::Error) -> Self {
        let missing = source.kind() == std::io::ErrorKind::NotFound;
        Self::of(path, if missing { DataFault::Missing } else { DataFault::Io(source) })
    }
}

impl std::error::Error for DataError {}

impl fmt::Display for DataError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.path)?;
        match (self.line, &self.column) {
            (Some(line), Some(column)) => write!(f, "line {line}, column {column}: ")?,
            (Some(line), None) => write!(f, "line {line}: ")?,
            (None, _) => {}
        }
        self.fault.fmt(f)
    }
}

/// The fault of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataFault {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is not a CSV in UTF-8.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// A file that the data set needs does not exist.
    #[error("missing")]
    Missing,
    #[error(
        "neither a KAIST Urban sequence (a folder with sensor_data in it) nor an NCLT one (with kvh.csv or ms25.csv)"
    )]
    UnknownLayout,
    /// The file has no rows.
    #[error("holds no samples")]
    Empty,
    /// The header lacks a column.
    #[error("column {0} is missing")]
    MissingColumn(&'static str),
    /// A row has more or fewer fields than the header.
    #[error("{found} fields, the header has {expected}")]
    Fields { found: usize, expected: usize },
    /// A row has more or fewer columns than the data set defines.
    #[error("{found} columns, expected {expected}")]
    Columns { found: usize, expected: usize },
    /// A field is not a valid value of its column.
    #[error("{text:?} is {error}")]
    Value { text: String, error: ValueError },
    /// Time does not increase.
    #[error("time goes {} from {last_s:.4} s to {at_s:.4} s",
        if at_s < last_s { "backwards" } else { "nowhere" })]
    Time { last_s: f64, at_s: f64 },
    /// A time stamp is earlier than the previous one.
    #[error("time goes backwards from {last} to {at}")]
    Backwards { last: i64, at: i64 },
    /// The gap before a row is so long that the rows after it belong to another drive.
    #[error("silent for {seconds:.0} s before this row; a gap of a drive is at most {most} s long")]
    Silent { seconds: f64, most: f64 },
    /// The recording is too short for static initialisation.
    #[error("is {seconds:.2} s long, static initialisation alone needs {needed} s")]
    TooShort { seconds: f64, needed: f64 },
    /// The files of a sequence have too little time in common.
    #[error("its files have {seconds:.2} s in common, needed are {needed} s")]
    TooLittleInCommon { seconds: f64, needed: f64 },
    /// The median period is not that of 100 Hz.
    #[error("is sampled at {hz:.1} Hz, should be 100 Hz")]
    Rate { hz: f64 },
    /// A wheel, 1 to 4, turns during static initialisation; its mean rate over a second is in rad/s.
    #[error("starts moving: line {line}, wheel {wheel} turns at {rate:.2} rad/s in the first 3 s")]
    Moving { line: u64, wheel: usize, rate: f64 },
    /// The wheels of a sequence turn during static initialisation.
    #[error(
        "starts moving: its wheels roll {metres:.2} m in the first 3 s; at most {most} m count as standing"
    )]
    Rolling { metres: f64, most: f64 },
    /// The calibration lacks a parameter, or the parameter is not a positive number.
    #[error("no usable parameter {0:?}")]
    Parameter(&'static str),
    /// The four numbers of an attitude are not a unit quaternion.
    #[error("a quaternion of norm {norm:.3}, which is no attitude")]
    Quaternion { norm: f64 },
    /// Two poses of a trajectory are too far apart to interpolate between them.
    #[error("{seconds:.2} s after the previous pose; at most {most} s can be interpolated")]
    FarApart { seconds: f64, most: f64 },
    /// A trajectory does not cover the time that is compared.
    #[error(
        "has poses from {from_s:.2} to {to_s:.2} s, but {begin_s:.2} to {end_s:.2} s are needed: wrong length or clock"
    )]
    Span { from_s: f64, to_s: f64, begin_s: f64, end_s: f64 },
    /// A trajectory does not start from the true pose.
    #[error("{metres:.2} m and {degrees:.1} deg from the truth at the start: the frames differ")]
    Frame { metres: f64, degrees: f64 },
    /// A trajectory is further from the truth than the vehicle can have driven.
    #[error("{metres:.0} m from the truth, where at most {most:.0} m are possible: it has diverged")]
    Diverged { metres: f64, most: f64 },
    /// An inertial sensor is needed, but the sequence has none.
    #[error("xsens_imu.csv has 8 columns: no gyro and no accelerometer")]
    NoGyro,
    /// The vehicle file cannot be used.
    #[error("not a valid vehicle file: {reason}")]
    Vehicle { reason: String },
}

/// The fault of one field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// The field is empty.
    #[error("empty")]
    Empty,
    /// The field is not a number.
    #[error("not a number")]
    NotANumber,
    /// The field is NaN or an infinity.
    #[error("not finite")]
    NotFinite,
    /// The value is larger than such a sensor can measure, or the time is negative.
    #[error("out of range")]
    OutOfRange,
}

impl From<gyronet::units::RangeError> for ValueError {
    fn from(error: gyronet::units::RangeError) -> Self {
        match error {
            gyronet::units::RangeError::NotFinite => Self::NotFinite,
            _ => Self::OutOfRange,
        }
    }
}
