//! The errors of files: recorded drives, data sets, weights, keys and others. They name the file and, if known, the line
//! and the column.

use gyronet::bias::StaticError;
use std::fmt;
use std::path::Path;

#[derive(Debug, thiserror::Error)]
#[error("{path}: {}{fault}", self.place())]
pub struct DataError {
    pub path: String,
    pub line: Option<u64>,
    pub column: Option<String>,
    pub fault: DataFault,
}

impl DataError {
    /// Returns an error that concerns a whole file.
    pub fn of(path: impl fmt::Display, fault: DataFault) -> Self {
        Self { path: path.to_string(), line: None, column: None, fault }
    }

    /// Returns an error of another kind that concerns a whole file.
    pub fn because(
        path: impl fmt::Display,
        reason: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Self {
        Self::of(path, DataFault::Other(reason.into()))
    }

    pub fn at(path: impl fmt::Display, line: u64, fault: DataFault) -> Self {
        Self { line: Some(line), ..Self::of(path, fault) }
    }

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

    fn place(&self) -> String {
        match (self.line, &self.column) {
            (Some(line), Some(column)) => format!("line {line}, column {column}: "),
            (Some(line), None) => format!("line {line}: "),
            (None, _) => String::new(),
        }
    }
}

/// Returns what names a file in an error of reading or writing it.
pub fn named(path: &Path) -> impl Fn(std::io::Error) -> DataError {
    move |source| DataError::of(path.display(), source.into())
}

pub fn read(path: &Path) -> Result<Vec<u8>, DataError> {
    std::fs::read(path).map_err(named(path))
}

pub fn read_text(path: &Path) -> Result<String, DataError> {
    std::fs::read_to_string(path).map_err(named(path))
}

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataFault {
    #[error(transparent)]
    Io(#[from] std::io::Error),
    #[error(transparent)]
    Csv(#[from] csv::Error),
    #[error("holds no samples")]
    Empty,
    #[error("column {0} is missing (a table of another tool becomes a drive by `gyronet import`)")]
    MissingColumn(&'static str),
    #[error("{found} fields, the header has {expected}")]
    Fields { found: usize, expected: usize },
    #[error("{text:?} is {error}")]
    Value { text: String, error: ValueError },
    #[error("time goes {} from {last_s:.4} s to {at_s:.4} s",
        if at_s < last_s { "backwards" } else { "nowhere" })]
    Time { last_s: f64, at_s: f64 },
    #[error("is {seconds:.2} s long, static initialisation alone needs {needed} s")]
    TooShort { seconds: f64, needed: f64 },
    #[error("is sampled at {hz:.1} Hz, should be 50 to 1000 Hz")]
    Rate { hz: f64 },
    /// A wheel, 1 to 4, turns during static initialisation; its mean rate over a second is in rad/s.
    #[error(
        "starts moving: line {}, wheel {} turns at {:.2} rad/s in the first 3 s; `gyronet doctor` looks for a later rest",
        .0.line, .0.wheel, .0.rate
    )]
    Moving(Turning),
    #[error("starts moving: line {line}: {source}")]
    StartsMoving {
        /// The line at which the three seconds ended.
        line: u64,
        source: StaticError,
    },
    #[error("never holds 3 s without a gap, so static initialisation cannot finish")]
    NeverInitialised,
    #[error(
        "no reference to evaluate against: neither a yaw rate (ref_gyr_z, in every row) nor a course (ref_yaw)"
    )]
    NoReference,
    #[error("not a valid vehicle file: {reason}")]
    Vehicle { reason: String },
    #[error("{format}, not a drive; import it first: {command}")]
    Foreign { format: &'static str, command: String },
    #[error(transparent)]
    Other(Box<dyn std::error::Error + Send + Sync>),
}

/// A wheel, counted from 1, that turns at this mean rate in a second, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    pub line: u64,
    pub wheel: usize,
    pub rate: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    #[error("empty")]
    Empty,
    #[error("not a number")]
    NotANumber,
    #[error("not finite")]
    NotFinite,
    #[error("out of range")]
    OutOfRange,
    #[error("outside +-16 rad/s: is it deg/s? `gyronet doctor` says what mends it")]
    Rate,
    #[error("outside +-2048 m/s^2")]
    Force,
}
