//! The choice of weights: the bundled ones, or a file.

use gyronet::model::{Blob, weights};
use gyronet_tools::bundled;
use gyronet_tools::network::checkpoint::{Checkpoint, CheckpointError, GyroNet};
use gyronet_tools::network::weight_file::{WeightFile, WeightFileError};
use std::path::{Path, PathBuf};

/// Weights of the integer network.
pub struct Weights(Option<WeightFile>);

impl Weights {
    /// Opens a file, or chooses the bundled weights.
    pub fn open(path: Option<&Path>) -> Result<Self, WeightFileError> {
        path.map(WeightFile::read).transpose().map(Self)
    }

    /// The checked weights.
    pub fn blob(&self) -> Result<Blob<'_>, WeightFileError> {
        match &self.0 {
            Some(file) => file.blob(),
            None => Blob::new_checked(&weights::DEFAULT.0)
                .map_err(|source| WeightFileError::Blob { path: String::from("built-in weights"), source }),
        }
    }
}

/// The networks to compare.
#[derive(Debug, Clone, clap::Args)]
pub struct Files {
    /// Weight file of the integer network [default: the one that comes with the library].
    #[arg(long, value_name = "BLOB")]
    pub weights: Option<PathBuf>,
    /// Checkpoint of the f32 network, safetensors [default: the one that comes with the tools].
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
}

impl Files {
    /// The integer network's weights.
    pub fn weights(&self) -> Result<Weights, WeightFileError> {
        Weights::open(self.weights.as_deref())
    }

    /// The f32 network's weights.
    pub fn checkpoint(&self) -> Result<Checkpoint<GyroNet>, CheckpointError> {
        self.checkpoint.as_deref().map_or_else(bundled::checkpoint, Checkpoint::read)
    }
}
