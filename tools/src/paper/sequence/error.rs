//! What can be wrong with a sequence.

use crate::drive::recording::ValueError;

/// Why a sequence cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// A file cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The folder is of neither data set.
    #[error(
        "{path}: neither a KAIST Urban sequence (a folder with sensor_data in it) nor an NCLT one (with kvh.csv or ms25.csv)"
    )]
    Unknown {
        /// The folder.
        path: String,
    },
    /// A file that the data set has is not there.
    #[error("{path}: missing")]
    Missing {
        /// The file, or what its name begins with.
        path: String,
    },
    /// No row at all.
    #[error("{path}: holds no samples")]
    Empty {
        /// The file.
        path: String,
    },
    /// Another number of columns than the data set has.
    #[error("{path}: line {line}: {found} columns, expected {expected}")]
    Columns {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// Columns of the row.
        found: usize,
        /// Columns of the data set.
        expected: usize,
    },
    /// A field is not a number, or beyond all sense.
    #[error("{path}: line {line}, column {column}: {text:?} is {error}")]
    Value {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// The column, the first being 1.
        column: usize,
        /// The field.
        text: String,
        /// What is wrong with it.
        error: ValueError,
    },
    /// Time goes backwards.
    #[error("{path}: line {line}: time goes backwards from {last} to {at}")]
    Backwards {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// Stamp of the row before.
        last: i64,
        /// Stamp of this row.
        at: i64,
    },
    /// A file stops for so long that what follows is another drive.
    #[error("{path}: line {line}: silent for {seconds:.0} s before it, at most {most} s are one drive")]
    Silent {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// Time since the row before, s.
        seconds: f64,
        /// What is allowed, s.
        most: f64,
    },
    /// The calibration has no such parameter.
    #[error("{path}: no usable parameter {parameter:?}")]
    Parameter {
        /// The file.
        path: String,
        /// What is missing or no positive number.
        parameter: &'static str,
    },
    /// The streams have no time, or next to none, in common.
    #[error("{path}: its files have {seconds:.2} s in common, needed are {needed} s")]
    TooShort {
        /// The folder.
        path: String,
        /// Common time.
        seconds: f64,
        /// Least time.
        needed: f64,
    },
    /// What was asked for needs the inertial sensor's gyro.
    #[error("{path}: xsens_imu.csv has 8 columns: no gyro and no accelerometer")]
    NoGyro {
        /// The folder.
        path: String,
    },
    /// The note that a sequence is simulated cannot be understood.
    #[error("{path}: {source}")]
    Marker {
        /// The file.
        path: String,
        /// What the parser said.
        source: serde_json::Error,
    },
}

impl SequenceError {
    /// Why a file could not be opened.
    pub(super) fn open(path: &str, source: std::io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            std::io::ErrorKind::NotFound => Self::Missing { path },
            _ => Self::Io { path, source },
        }
    }
}
