//! What can be wrong with a recording.

/// Why a recording cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not a CSV in UTF-8, or reading broke off.
    #[error("{path}: {source}")]
    Csv {
        /// The file.
        path: String,
        /// What the CSV reader said; it names the line.
        source: csv::Error,
    },
    /// No row at all.
    #[error("{path}: holds no samples")]
    Empty {
        /// The file.
        path: String,
    },
    /// A column that is needed is not in the header.
    #[error("{path}: column {column} is missing")]
    MissingColumn {
        /// The file.
        path: String,
        /// The column.
        column: &'static str,
    },
    /// A row has more or fewer fields than the header.
    #[error("{path}: line {line}: {found} fields, the header has {expected}")]
    Fields {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A field is not what its column needs.
    #[error("{path}: line {line}, column {column}: {text:?} is {error}")]
    Value {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// The column.
        column: &'static str,
        /// The field.
        text: String,
        /// What is wrong with it.
        error: ValueError,
    },
    /// Time does not rise.
    #[error("{path}: line {line}: time goes {} from {last_s:.4} s to {at_s:.4} s",
        if at_s < last_s { "backwards" } else { "nowhere" })]
    Time {
        /// The file.
        path: String,
        /// The line.
        line: u64,
        /// Time of the row before, s.
        last_s: f64,
        /// Time of this row, s.
        at_s: f64,
    },
    /// Too short for static initialisation.
    #[error("{path}: is {seconds:.2} s long, static initialisation alone needs {needed} s")]
    TooShort {
        /// The file.
        path: String,
        /// Its length.
        seconds: f64,
        /// What it should be at least.
        needed: f64,
    },
    /// Not at the rate of the networks.
    #[error("{path}: is sampled at {hz:.1} Hz, should be 100 Hz")]
    Rate {
        /// The file.
        path: String,
        /// From the median period.
        hz: f64,
    },
    /// A wheel turns during static initialisation.
    #[error("{path}: starts moving: line {line}, wheel {wheel} turns at {rate:.2} rad/s in the first 3 s")]
    Moving {
        /// The file.
        path: String,
        /// The first line on which it does.
        line: u64,
        /// 1 to 4.
        wheel: usize,
        /// Its mean rate over a second.
        rate: f64,
    },
}

/// What is wrong with one field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// Nothing there.
    #[error("empty")]
    Empty,
    /// Text.
    #[error("not a number")]
    NotANumber,
    /// NaN or an infinity.
    #[error("not finite")]
    NotFinite,
    /// More than any part of this kind can measure, or a time before zero.
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
