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
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is not a CSV in UTF-8.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// A file that the data set needs does not exist.
    #[error("missing")]
    Missing,
    /// The file has no rows.
    #[error("holds no samples")]
    Empty,
    /// The header lacks a column.
    #[error("column {0} is missing (a table of another tool becomes a drive by `gyronet import`)")]
    MissingColumn(&'static str),
    /// A row has more or fewer fields than the header.
    #[error("{found} fields, the header has {expected}")]
    Fields { found: usize, expected: usize },
    /// A field is not a valid value of its column.
    #[error("{text:?} is {error}")]
    Value { text: String, error: ValueError },
    /// Time does not increase.
    #[error("time goes {} from {last_s:.4} s to {at_s:.4} s",
        if at_s < last_s { "backwards" } else { "nowhere" })]
    Time { last_s: f64, at_s: f64 },
    /// The recording is too short for static initialisation.
    #[error("is {seconds:.2} s long, static initialisation alone needs {needed} s")]
    TooShort { seconds: f64, needed: f64 },
    /// The usual period is not used by the board.
    #[error("is sampled at {hz:.1} Hz, should be 50 to 1000 Hz")]
    Rate { hz: f64 },
    /// A wheel, 1 to 4, turns during static initialisation; its mean rate over a second is in rad/s.
    #[error("starts moving: line {line}, wheel {wheel} turns at {rate:.2} rad/s in the first 3 s")]
    Moving { line: u64, wheel: usize, rate: f64 },
    /// The vehicle file cannot be used.
    #[error("not a valid vehicle file: {reason}")]
    Vehicle { reason: String },
    /// A log of another tool.
    #[error("{format}, not a drive; import it first: {command}")]
    Foreign { format: &'static str, command: String },
    /// A fault of a data set, described by its reader.
    #[error(transparent)]
    Other(Box<dyn std::error::Error + Send + Sync>),
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
