//! `gyronet soak` runs hours of a simulated drive in which every clock and counter wraps.

use super::weights::Weights;
use super::{Common, print_json, progress};
use gyronet::model::GyroNet;
use gyronet::sample::RATE_HZ;
use gyronet_tools::campaign::soak;
use std::io::Write;

/// Run hours of a simulated drive in which every clock and counter wraps.
///
/// The command encodes the drive as sensor bytes, runs them through the board's code, and checks the CAN frames with
/// a receiver. It prints all counters. The exit status is 1 if a sample or frame is lost, a clock or the yaw drifts,
/// or memory grows.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet soak                  # 24 simulated hours; runs for minutes
  gyronet soak --hours 2 --json")]
pub struct Args {
    /// Length of the drive, hours (1 to 200).
    #[arg(long, value_name = "HOURS", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=200))]
    hours: u32,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = Weights::open(None)?;
    let mut network = GyroNet::new(weights.blob()?);
    let minutes = 60 * args.hours;
    let bar = progress::bar(common, minutes as usize, "minutes");
    let soak = soak::run(minutes * 60 * RATE_HZ, &mut network, || bar.inc(1));
    bar.finish_and_clear();
    let faults = soak.faults();
    let out = &mut std::io::stdout().lock();
    let written = if common.json {
        print_json(out, &serde_json::json!({ "soak": soak, "faults": faults }))
    } else {
        writeln!(out, "{soak}").map_err(Into::into)
    };
    // A failed check is reported even if the output could not be written.
    if faults.is_empty() { written } else { Err(faults.join("; ").into()) }
}
