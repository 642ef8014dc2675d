//! `gyronet warm-up` compares headings while the sensor warms up and the vehicle does not stop.

use super::weights::Weights;
use super::{Common, WriteError, print_json, progress};
use gyronet::model::GyroNet;
use gyronet_tools::warm_up::{self, plot};
use std::io::Write;
use std::path::PathBuf;

/// Compare heading errors while a sensor warms up on a drive without a stop.
///
/// Everything is simulated. Each device first drives through a town on six days, and the board fills its bias curve
/// at standstills. Then it drives half an hour without a stop: the sensor warms up by 10 K, and its bias also drifts
/// by 0.01 deg/s per hour. The command prints the RMS and the worst heading error of each method.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet warm-up                        # 16 devices; runs for a minute or two
  gyronet warm-up --devices 2 --plot warm_up.svg")]
pub struct Args {
    /// Number of devices (1 to 1000).
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..=1000))]
    devices: u64,
    /// Seed of the first device.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Plot bias, sigma and heading error of the first device to this file.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = Weights::open(None)?;
    let mut network = GyroNet::new(weights.blob()?);
    let bar = progress::bar(common, 7 * args.devices as usize, "drives");
    let outcome = warm_up::run(args.devices, args.seed, &mut network, || bar.inc(1))?;
    bar.finish_and_clear();
    if let Some(path) = &args.plot {
        std::fs::write(path, plot::svg(&outcome.states)?).map_err(WriteError::to(path))?;
    }
    let out = &mut std::io::stdout().lock();
    if common.json {
        return print_json(out, &outcome);
    }
    writeln!(out, "heading error after half an hour without a stop, {} devices, simulated", args.devices)?;
    writeln!(out, "{:<22}{:>10}{:>12}{:>8}", "method", "RMS, deg", "worst, deg", "ratio")?;
    for row in &outcome.rows {
        let worst = row.error_deg.iter().fold(0.0f64, |worst, error| worst.max(error.abs()));
        writeln!(out, "{:<22}{:>10.2}{:>12.2}{:>8.2}", row.name, row.rms_deg, worst, row.ratio)?;
    }
    let [curve, without] = outcome.inside_one_sigma.map(|share| 100.0 * share);
    writeln!(out, "minutes inside one sigma: {curve:.0} % with the curve, {without:.0} % without")?;
    Ok(())
}
