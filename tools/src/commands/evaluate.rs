//! `gyronet evaluate`: yaw errors of each method on recorded drives.

use super::{Common, networks, progress};
use gyronet::model::GyroNet;
use gyronet_tools::evaluate::{DriveErrors, Report};
use gyronet_tools::methods::Rates;
use gyronet_tools::recording::Recording;
use std::io::Write;
use std::path::PathBuf;

/// Compare the yaw errors of raw gyro, static initialisation, FIR, GyroNet f32 and GyroNet
/// integer on recorded drives.
///
/// A drive is a CSV at 100 Hz with the columns t_s, acc_x/y/z, gyr_x/y/z and ref_gyr_z, and
/// stands still for its first 3 s. Printed for each drive, and as a mean: the mean error of the
/// yaw change over 1 s, and the error of the yaw at the end. The two GyroNet rows are its settled
/// estimates, known 110 ms later; the last row is what the board sends at once.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Recordings.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    networks: networks::Files,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let checkpoint = args.networks.checkpoint()?;
    let weights = args.networks.weights()?;
    let mut integer = GyroNet::new(weights.blob()?);
    let mut drives = Vec::new();
    for file in &args.files {
        let recording = Recording::read(file)?;
        let bar = progress::bar(common, 2 * recording.rows.len(), recording.name());
        let rates = Rates::new(&recording, &mut checkpoint.network(), &mut integer, || bar.inc(1));
        bar.finish_and_clear();
        drives.push(DriveErrors::new(&recording, &rates?)?);
    }
    let report = Report::new(drives);
    let mut out = std::io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        write!(out, "{report}")?;
    }
    Ok(())
}
