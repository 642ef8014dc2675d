//! `gyronet evaluate`: yaw errors of each method on recorded drives.

use super::{Common, networks, progress};
use gyronet::model::GyroNet;
use gyronet_tools::ablation::{self, Floor, Score, Variant};
use gyronet_tools::evaluate::{DriveErrors, Report};
use gyronet_tools::methods::{self, Rates};
use gyronet_tools::recording::Recording;
use std::io::Write;
use std::path::PathBuf;

/// Compare the yaw errors of raw gyro, static initialisation, FIR, GyroNet f32 and GyroNet
/// integer on recorded drives.
///
/// A drive is a CSV at 100 Hz with the columns t_s, acc_x/y/z, gyr_x/y/z and ref_gyr_z, and
/// stands still for its first 3 s; wheelN_rate stand in for the vehicle's bus. Printed for each
/// drive, and as a mean: the mean error of the yaw change over 1 s, and the error of the yaw at
/// the end. The network rows are settled estimates after static initialisation; the last two
/// are what the board sends: at once (Bosch, VDC2), and in its own yaw messages.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Recordings.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// What each part of the compensation is worth, how often the errors stay inside one, two
    /// and three sigma, and what the reference shows at standstill.
    #[arg(long, conflicts_with_all = ["json", "lags"])]
    ablation: bool,
    /// The default at every lag.
    #[arg(long, conflicts_with = "json")]
    lags: bool,
    #[command(flatten)]
    networks: networks::Files,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    if args.ablation {
        return compare(args, common, &ablation::parts());
    }
    if args.lags {
        return compare(args, common, &ablation::lags());
    }
    let checkpoint = args.networks.checkpoint()?;
    let weights = args.networks.weights()?;
    let mut integer = GyroNet::new(weights.blob()?);
    let mut drives = Vec::new();
    for file in &args.files {
        let recording = Recording::read(file)?;
        let bar = progress::bar(common, methods::RUNS * recording.rows.len(), recording.name());
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

fn compare(args: &Args, common: Common, variants: &[Variant]) -> super::Result {
    let weights = args.networks.weights()?;
    let mut network = GyroNet::new(weights.blob()?);
    let mut drives = Vec::new();
    let mut out = std::io::stdout().lock();
    for file in &args.files {
        let recording = Recording::read(file)?;
        let bar = progress::bar(common, variants.len() * recording.rows.len(), recording.name());
        let scores = ablation::run(&recording, &mut network, variants, || bar.inc(1));
        bar.finish_and_clear();
        let scores = scores?;
        if scores.is_empty() {
            return Err(format!("{}: no reference yaw rate, which evaluation needs", recording.path).into());
        }
        writeln!(out, "{}", recording.name())?;
        print(&mut out, &scores)?;
        if let Some(Floor { seconds, mean_1s_rad, bias_rad_per_s }) = ablation::floor(&recording) {
            writeln!(
                out,
                "  reference at standstill: {mean_1s_rad:.6} rad in 1 s over {seconds} s, mean {bias_rad_per_s:+.6} rad/s"
            )?;
        }
        writeln!(out)?;
        drives.push(scores);
    }
    if let ([_, _, ..], Some(mean)) = (drives.as_slice(), ablation::mean(&drives)) {
        writeln!(out, "mean of {} drives", drives.len())?;
        print(&mut out, &mean)?;
    }
    Ok(())
}

fn print(out: &mut impl Write, scores: &[Score]) -> std::io::Result<()> {
    writeln!(
        out,
        "  {:<22}{:>14}{:>14}{:>12}{:>12}   inside 1, 2, 3 sigma",
        "yaw error", "in 1 s, rad", "sample, rad/s", "final, rad", "sigma, rad"
    )?;
    for Score { name, error, rms_rad_per_s, inside_sigma: [one, two, three], sigma_rad } in scores {
        writeln!(
            out,
            "  {name:<22}{:>14.6}{rms_rad_per_s:>14.6}{:>12.6}{sigma_rad:>12.6}   {one:.3} {two:.3} {three:.3}",
            error.mean_1s_rad, error.final_rad
        )?;
    }
    Ok(())
}
