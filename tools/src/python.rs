//! Python reads logs: [`package`] finds the package of this repository that does, or makes an environment for it.

pub mod package;

use crate::drive::error::DataError;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
pub enum PythonError {
    #[error(transparent)]
    File(#[from] DataError),
    #[error(
        "logs are read by Python, and python3 cannot be started ({source}): install Python 3.11 or later, or set GYRONET_PYTHON"
    )]
    NoPython { source: std::io::Error },
    #[error(
        "logs are read by Python 3.11 or later, and python3 is older: set GYRONET_PYTHON to a later one with tools/requirements.txt"
    )]
    OldPython,
    #[error(
        "{} does not have the Python package gyronet {version}, which the board, and logs outside a checkout of gyronet, need: \
         pip install ./tools/python in a checkout", python.display()
    )]
    NoPackage { python: PathBuf, version: &'static str },
    #[error(
        "the Python packages that read logs could not be installed: {step}: {reason} (without a network: pip install -r tools/requirements.txt from a mirror, and GYRONET_PYTHON)"
    )]
    Install { step: &'static str, reason: String },
}

fn last_line(said: &[u8]) -> String {
    let text = String::from_utf8_lossy(said);
    text.trim().lines().last().unwrap_or("ended without a message").to_owned()
}
