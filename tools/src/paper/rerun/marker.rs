//! This module keeps a marker file for each finished step. The marker records the step's command and inputs, so that
//! a step is run again only if one of these has changed.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use std::{fs, io};

/// Holds the command and the inputs of a finished step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// The command and its arguments.
    pub command: Vec<String>,
    /// The files that the step read, each with its length and modification time.
    pub inputs: Vec<String>,
    /// The steps whose results the step read, with the hashes of their markers.
    pub steps: Vec<String>,
    /// Run time of the step, s.
    pub seconds: f64,
}

impl Marker {
    /// Returns the marker that a step would get if it were run now.
    ///
    /// # Errors
    /// The file system's error if a file cannot be read.
    pub fn of(command: Vec<String>, inputs: &[PathBuf], steps: Vec<String>) -> io::Result<Self> {
        let inputs = inputs.iter().map(|path| stamp(path)).collect::<io::Result<_>>()?;
        Ok(Self { command, inputs, steps, seconds: 0.0 })
    }

    /// Reads the marker of a finished step; `None` if there is no readable marker.
    #[must_use]
    pub fn read(path: &Path) -> Option<Self> {
        serde_json::from_slice(&fs::read(path).ok()?).ok()
    }

    /// Writes the marker atomically.
    ///
    /// # Errors
    /// The file system's error.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let unfinished = path.with_extension("tmp");
        fs::write(&unfinished, serde_json::to_string_pretty(self)? + "\n")?;
        fs::rename(unfinished, path)
    }

    /// Returns whether two markers have the same command and inputs.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.hash() == other.hash()
    }

    /// Returns the hash of everything except the run time.
    #[must_use]
    pub fn hash(&self) -> String {
        let mut hash = Sha256::new();
        for list in [&self.command, &self.inputs, &self.steps] {
            for text in list {
                hash.update((text.len() as u64).to_le_bytes());
                hash.update(text);
            }
            hash.update(u64::MAX.to_le_bytes());
        }
        format!("{:.32x}", hash.finalize())
    }
}

fn stamp(path: &Path) -> io::Result<String> {
    let named = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
    let data = fs::metadata(path).map_err(named)?;
    let changed = data.modified().map_err(named)?.duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok(format!("{} {} bytes {} ns", path.display(), data.len(), changed.as_nanos()))
}
