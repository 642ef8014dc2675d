//! `gyronet demo`: one drive, everything that comes of it.

use super::{Common, WriteError, networks, progress, replay};
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::model::GyroNet;
use gyronet_tools::evaluate::{DriveErrors, EvaluateError, Report};
use gyronet_tools::methods::{self, Rates};
use gyronet_tools::recording::Recording;
use gyronet_tools::{bundled, plot};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Run a drive through every method: print the errors, write the CAN log and a picture.
///
/// Without a file it takes the simulated drive that comes with the binary.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Recording; the errors are printed where it has the true yaw rate in ref_gyr_z.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Folder for can.log and yaw.svg [default: target/demo].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    networks: networks::Files,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let checkpoint = args.networks.checkpoint()?;
    let weights = args.networks.weights()?;
    let (recording, title) = match &args.file {
        Some(path) => {
            let recording = Recording::read(path)?;
            let title = format!("Yaw of a recorded drive, {}", recording.name());
            (recording, title)
        }
        None => (bundled::simulated_drive()?, String::from("Yaw of a simulated drive")),
    };
    let bar = progress::bar(common, methods::RUNS * recording.rows.len(), recording.name());
    let mut integer = GyroNet::new(weights.blob()?);
    let rates = Rates::new(&recording, &mut checkpoint.network(), &mut integer, || bar.inc(1));
    bar.finish_and_clear();
    let rates = rates?;
    let report = match DriveErrors::new(&recording, &rates) {
        Ok(errors) => Some(Report::new(vec![errors])),
        // A drive without a reference still has its log and its picture.
        Err(EvaluateError::NoReference { .. }) => None,
        Err(error) => return Err(error.into()),
    };

    let folder = args.out.clone().unwrap_or_else(default_folder);
    std::fs::create_dir_all(&folder).map_err(WriteError::to(&folder))?;
    let (log, picture) = (folder.join("can.log"), folder.join("yaw.svg"));
    let frames = replay::write_file(&rates.drive, &mut Feeds::new(Config::DEFAULT), &log)?;
    std::fs::write(&picture, plot::svg(&title, &rates)?).map_err(WriteError::to(&picture))?;

    let mut out = std::io::stdout().lock();
    if args.file.is_none() {
        writeln!(out, "SIMULATED drive: it shows the way of the data, not how good GyroNet is on a car.")?;
        writeln!(out, "For a real one: gyronet demo FILE.csv\n")?;
    }
    match report {
        Some(report) => write!(out, "{report}")?,
        None => writeln!(out, "{}: no reference yaw rate, so no errors\n", recording.name())?,
    }
    writeln!(out, "{frames} CAN frames: {}", log.display())?;
    writeln!(out, "picture: {}", picture.display())?;
    Ok(())
}

/// `target/demo` of the workspace when cargo runs the binary, else of the working directory.
fn default_folder() -> PathBuf {
    let workspace = std::env::var_os("CARGO_MANIFEST_DIR")
        .and_then(|manifest| Some(Path::new(&manifest).parent()?.to_owned()));
    workspace.unwrap_or_default().join("target/demo")
}
