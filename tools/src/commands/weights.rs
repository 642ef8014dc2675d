//! Chooses the weights, bundled or from a file, and computes the rates of every method with them.

use super::{Common, progress};
use gyronet::model::{self, Blob, weights};
use gyronet_tools::bundled;
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::evaluate::rates::{self, Network, Networks, Rates};
use gyronet_tools::network::checkpoint::{Checkpoint, CheckpointError, GyroNet};
use gyronet_tools::network::weight_file::{WeightFile, WeightFileError};
use indicatif::ProgressBar;
use std::error::Error;
use std::path::{Path, PathBuf};

/// The weights of the integer network.
pub struct Weights {
    file: Option<WeightFile>,
}

impl Weights {
    /// Opens a file, or chooses the default weights.
    pub fn open(path: Option<&Path>) -> Result<Self, WeightFileError> {
        Ok(Self { file: path.map(WeightFile::read).transpose()? })
    }

    /// Checks the weights and returns them.
    pub fn blob(&self) -> Result<Blob<'_>, WeightFileError> {
        match &self.file {
            Some(file) => file.blob(),
            None => Blob::new_checked(&weights::DEFAULT.0)
                .map_err(|source| WeightFileError::Blob { path: String::from("built-in weights"), source }),
        }
    }
}

/// The networks to compare.
#[derive(Debug, Clone, clap::Args)]
pub struct Files {
    /// Weight file for the rates that the board sends [default: the library's default model].
    #[arg(long, value_name = "BLOB")]
    pub weights: Option<PathBuf>,
    /// Checkpoint of the f32 network (safetensors) [default: the one that comes with the tools].
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
}

impl Files {
    /// Opens the integer network's weights.
    pub fn weights(&self) -> Result<Weights, WeightFileError> {
        Weights::open(self.weights.as_deref())
    }

    /// Reads the f32 network's weights.
    fn checkpoint(&self) -> Result<Checkpoint<GyroNet>, CheckpointError> {
        self.checkpoint.as_deref().map_or_else(bundled::checkpoint, Checkpoint::read)
    }

    /// Computes the rates of a drive by every method, with a progress bar. GyroNet and the linear part always have
    /// the library's weights; only the sent rates have the chosen ones.
    pub fn rates(&self, recording: &Recording, common: Common) -> Result<Rates, Box<dyn Error>> {
        let bar = progress::bar(common, 0, recording.name());
        let rates = self.rates_with(recording, &bar);
        bar.finish_and_clear();
        rates.map_err(|error| -> Box<dyn Error> { error })
    }

    /// Computes the rates as [`Self::rates`] does, with the caller's progress bar, for use in a thread.
    pub fn rates_with(
        &self,
        recording: &Recording,
        bar: &ProgressBar,
    ) -> Result<Rates, Box<dyn Error + Send + Sync>> {
        let checkpoint = self.checkpoint()?;
        let (mut float, sent) = (checkpoint.network(), self.weights()?);
        let mut integer = model::GyroNet::new(Blob::new_checked(&weights::GYRONET.0)?);
        let mut default = model::GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?);
        let mut sent = self.weights.as_ref().map(|_| sent.blob().map(model::GyroNet::new)).transpose()?;
        let [of_integer, of_default] = [&integer, &default].map(|network| network.blob().shape);
        let mut networks = Networks {
            float: Network::new(&mut float, checkpoint.shape()),
            integer: Network::new(&mut integer, of_integer),
            default: Network::new(&mut default, of_default),
            sent: sent.as_mut().map(|sent| {
                let shape = sent.blob().shape;
                Network::new(sent, shape)
            }),
        };
        bar.set_length((rates::RUNS * recording.rows.len()) as u64);
        Ok(Rates::new(recording, &mut networks, || bar.inc(1))?)
    }
}
