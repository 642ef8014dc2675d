//! The error of an import: one line that names the file and what to do.

/// The reason for a refusal.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each names its fields")]
pub enum ImportError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Io { path: String, source: std::io::Error },
    /// The format is none that is read, or is damaged at its start.
    #[error("{path}: {reason}")]
    Format { path: String, reason: String },
    /// The DBC file cannot be used.
    #[error("{path}: no DBC file: {reason}")]
    Dbc { path: String, reason: String },
    /// The files hold no channel that fits.
    #[error("no {role} in the files{}", list(.candidates, "; there are "))]
    Missing { role: &'static str, candidates: Vec<String> },
    /// Several channels are.
    #[error("several channels fit as {role}: name one in the vehicle file or with --{role}{}", list(.candidates, ": "))]
    Ambiguous { role: &'static str, candidates: Vec<String> },
    /// A name is not in the files.
    #[error("no channel {name} for {role}{}", list(.candidates, "; there are "))]
    Unknown { role: &'static str, name: String, candidates: Vec<String> },
    /// The rate is outside of what the grid takes.
    #[error("{channel}: {hz:.1} Hz, a drive needs 25 to 1000 Hz")]
    Rate { channel: String, hz: f64 },
    /// Two clocks cannot be laid on each other.
    #[error("{path}: its clock cannot be laid on that of {first}: {reason}")]
    Clock { path: String, first: String, reason: String },
    /// A drive would be shorter than static initialisation.
    #[error("{channel}: {seconds:.2} s are no drive")]
    Short { channel: String, seconds: f64 },
}

fn list(names: &[String], before: &str) -> String {
    if names.is_empty() { String::new() } else { format!("{before}{}", names.join(", ")) }
}
