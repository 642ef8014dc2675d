//! `gyronet wheels` creates and checks the settings of a vehicle's wheel frames.

use super::{Common, WriteError, print_json};
use gyronet_tools::wheels::{WheelFile, from_dbc};
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

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
    /// Two wheels of one axle are enough. A DBC file does not say how a frame is protected: add checksum and counter
    /// by hand. tools/README.md lists all settings.
    #[command(after_help = "\
Examples:
  gyronet wheels from-dbc car.dbc --front-left WHL_SPD_FL --front-right WHL_SPD_FR \\
      --rear-left WHL_SPD_RL --rear-right WHL_SPD_RR --out wheels.toml")]
    FromDbc {
        /// DBC file of the vehicle's bus.
        file: PathBuf,
        /// Signal of the front left wheel: SIGNAL or MESSAGE.SIGNAL.
        #[arg(long, value_name = "SIGNAL", requires = "front_right")]
        front_left: Option<String>,
        /// Signal of the front right wheel.
        #[arg(long, value_name = "SIGNAL", requires = "front_left")]
        front_right: Option<String>,
        /// Signal of the rear left wheel.
        #[arg(long, value_name = "SIGNAL", requires = "rear_right")]
        rear_left: Option<String>,
        /// Signal of the rear right wheel.
        #[arg(long, value_name = "SIGNAL", requires = "rear_left")]
        rear_right: Option<String>,
        /// Write the settings to this file instead of standard output.
        #[arg(long, value_name = "FILE.toml")]
        out: Option<PathBuf>,
    },
    /// Check a settings file as the board does.
    Check {
        /// Settings file (.toml).
        file: PathBuf,
    },
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    match &args.action {
        Action::FromDbc { file, front_left, front_right, rear_left, rear_right, out } => {
            let signals = [front_left, front_right, rear_left, rear_right].map(Option::as_deref);
            let path = file.display().to_string();
            let settings = from_dbc(&path, &read(file)?, signals)?;
            settings.settings(&path)?;
            let text = toml::to_string(&settings)?;
            match out {
                Some(out) => std::fs::write(out, text).map_err(WriteError::to(out))?,
                None if common.json => print_json(&mut stdout().lock(), &settings)?,
                None => write!(stdout().lock(), "{text}")?,
            }
        }
        Action::Check { file } => {
            let path = file.display().to_string();
            let settings = WheelFile::parse(&path, &read(file)?)?;
            settings.settings(&path)?;
            if common.json {
                return print_json(&mut stdout().lock(), &settings);
            }
            let wheels: usize = settings.frame.iter().map(|frame| frame.signal.len()).sum();
            writeln!(stdout().lock(), "{path}: {wheels} wheels in {} frames", settings.frame.len())?;
        }
    }
    Ok(())
}

fn read(file: &Path) -> Result<String, String> {
    // DBC files are often in Latin-1; names and numbers are ASCII.
    let bytes = std::fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
