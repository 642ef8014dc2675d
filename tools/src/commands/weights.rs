//! Chooses the weights, bundled or from a file, and runs every method with them.

use super::{Common, remarked};
use gyronet::model::{self, Blob, WindowNetwork, weights};
use gyronet_tools::calibrate::unit_file;
use gyronet_tools::drive::error::DataError;
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::rates::{Networks, Sample};
use gyronet_tools::evaluate::report::DriveErrors;
use gyronet_tools::network::checkpoint::{Checkpoint, GyroNet};
use gyronet_tools::network::weight_file::WeightFile;
use std::error::Error;
use std::path::PathBuf;

/// The weights of the rates that the board sends.
#[derive(Debug, Clone, clap::Args)]
pub struct Sent {
    /// Weight file for the rates that the board sends [default: the library's default model].
    #[arg(long, value_name = "BLOB")]
    pub weights: Option<PathBuf>,
}

/// The rates that the board of a unit sends.
#[derive(Debug, Clone, clap::Args)]
pub struct Unit {
    /// Calibration file from `gyronet calibrate`, applied to the gyro (of every method). It corrects only the gain and
    /// mounting errors that remain after the weights' correction.
    #[arg(long, value_name = "FILE.json")]
    calibration: Option<PathBuf>,
    #[command(flatten)]
    pub sent: Sent,
}

impl Unit {
    /// The opened drive with the calibration, if one is given.
    pub fn drive(
        &self,
        opened: Result<Drive<'static>, DataError>,
        common: Common,
    ) -> Result<Drive<'static>, Box<dyn Error + Send + Sync>> {
        let mut drive = remarked(opened?, common)?;
        if let Some(path) = &self.calibration {
            drive.gyro_map = Some(unit_file::read_for(path, self.sent.open()?.blob()?.crc)?);
        }
        Ok(drive)
    }
}

impl Sent {
    /// Opens the weights and checks them.
    pub fn open(&self) -> Result<WeightFile, DataError> {
        let file = match &self.weights {
            Some(path) => WeightFile::read(path)?,
            None => WeightFile::new("built-in weights", &weights::DEFAULT.0),
        };
        file.blob()?;
        Ok(file)
    }

    /// Runs every method on a drive ([`DriveErrors::of`]). The linear part always has the library's weights; only the
    /// sent rates have the chosen ones.
    pub fn errors(
        &self,
        drive: &Drive<'_>,
        paper: Option<&Checkpoint<GyroNet>>,
        visit: impl FnMut(&Sample),
    ) -> Result<DriveErrors, Box<dyn Error + Send + Sync>> {
        let mut default = model::GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?);
        let chosen = self.open()?;
        let mut sent = self.weights.as_ref().map(|_| chosen.blob().map(model::GyroNet::new)).transpose()?;
        let mut integer = model::GyroNet::new(Blob::new_checked(&weights::GYRONET.0)?);
        let mut float = paper.map(|checkpoint| checkpoint.network());
        let networks = Networks {
            default: &mut default,
            sent: sent.as_mut().map(|sent| sent as _),
            paper: float.as_mut().map(|float| -> [&mut dyn WindowNetwork; 2] { [float, &mut integer] }),
        };
        Ok(DriveErrors::of(drive, networks, visit)?)
    }
}
