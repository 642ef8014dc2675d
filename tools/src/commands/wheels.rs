//! `gyronet wheels` creates and checks the settings of a vehicle's wheel frames.

use super::{Common, print};
use gyronet::store::Configuration;
use gyronet_tools::wheels::WheelFile;
use std::ffi::OsString;
use std::path::PathBuf;

/// Create or check the settings of a vehicle's wheel frames.
///
/// By default the board receives the wheel speeds of one maker's cars (identifier 0xAA). For another vehicle, create
/// a settings file (.toml) and write it to the board: `gyronet device set --file wheels.toml`. The exit status is 1
/// if the board would refuse the settings.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet wheels from-dbc car.dbc --rear-left RL --rear-right RR --out wheels.toml
  gyronet wheels check wheels.toml
  gyronet device --port /dev/ttyUSB1 set --file wheels.toml")]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Clone, clap::Subcommand)]
enum Action {
    /// Create a settings file from a DBC file and the names of its signals.
    ///
    /// The package `gyronet` in Python reads the DBC file, as in `gyronet import`.
    #[command(disable_help_flag = true)]
    FromDbc {
        /// Arguments of the Python package's command.
        #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Check a settings file as the board does, beside the default identifiers.
    Check {
        /// Settings file (.toml).
        file: PathBuf,
    },
}

pub fn run(args: &Args, common: Common) -> super::Result {
    match &args.action {
        Action::FromDbc { arguments } => super::import::python(&["wheels", "from-dbc"], arguments, common)?,
        Action::Check { file } => {
            let (path, (settings, wheels)) = (file.display(), WheelFile::read(file)?);
            let board = Configuration::DEFAULT.check_wheels(&wheels);
            board.map_err(|error| format!("{path}: {error}"))?;
            let wheels: usize = settings.frame.iter().map(|frame| frame.signal.len()).sum();
            let text = format_args!("{path}: {wheels} wheels in {} frames", settings.frame.len());
            print(common, &settings, text)?;
        }
    }
    Ok(())
}
