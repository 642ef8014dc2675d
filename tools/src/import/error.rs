//! The errors of an import: one line with the file or channel, and what to do.

/// The reason why logs cannot be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Io { path: String, source: std::io::Error },
    /// The format is not supported, or the beginning of the file is corrupt.
    #[error("{path}: {reason}")]
    Format { path: String, reason: String },
    /// The DBC file cannot be used.
    #[error("{path}: not a valid DBC file: {reason}")]
    Dbc { path: String, reason: String },
    /// No channel in the files fits the role.
    #[error("no {role} in the files{}", list(.candidates, "; there are "))]
    Missing { role: &'static str, candidates: Vec<String> },
    /// Several channels fit the role.
    #[error("several channels fit as {role}: name one in the vehicle file or with --{role}{}", list(.candidates, ": "))]
    Ambiguous { role: &'static str, candidates: Vec<String> },
    /// The named channel is not in the files, or in several of them.
    #[error("no channel {name} for {role}{}", list(.candidates, "; there are "))]
    Unknown { role: &'static str, name: String, candidates: Vec<String> },
    /// The sample rate of the IMU is out of range.
    #[error("{channel}: {hz:.1} Hz, but an IMU needs 25 to 1000 Hz")]
    Rate { channel: String, hz: f64 },
    /// The clocks of two files cannot be aligned.
    #[error("{path}: the clock cannot be aligned with that of {first}: {reason}")]
    Clock { path: String, first: String, reason: String },
    /// The drive would be shorter than static initialisation, or longer than a day.
    #[error("{channel}: {seconds:.2} s, but a drive is 3 s to a day long")]
    Short { channel: String, seconds: f64 },
}

fn list(names: &[String], before: &str) -> String {
    if names.is_empty() { String::new() } else { format!("{before}{}", names.join(", ")) }
}
