//! `gyronet soak`: hours of a drive, every clock and counter wrapping.

use super::networks::Weights;
use super::{Common, progress};
use gyronet::model::GyroNet;
use gyronet::sample::RATE_HZ;
use gyronet_tools::soak;

/// Run hours of a simulated drive through the whole way of the data, from a part's bytes to a
/// receiver of the CAN frames.
///
/// Every clock and counter on the way wraps. Prints what was counted; exit status 1 where a
/// sample or frame is lost, a clock or the yaw drifts, or memory grows.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Length of the drive.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=200))]
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
    println!("{soak}");
    let faults = soak.faults();
    if faults.is_empty() { Ok(()) } else { Err(faults.join("; ").into()) }
}
