//! `gyronet-paper simulate` writes simulated sequences.

use super::{named, remark};
use gyronet_paper::simulate::{self, Set, Spec};
use std::path::{Path, PathBuf};

/// Write simulated sequences of a drive through a town, with a fibre-optic gyro and wheels.
///
/// The folders and formats are those of KAIST Complex Urban; a file simulated.json marks a sequence as
/// simulated. The same seed gives the same files on every machine.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet-paper simulate --set test --out sequences      # four sequences of 20 min
  gyronet-paper simulate --minutes 5 --seed 7 --out one")]
pub struct Args {
    /// Folder of the sequence, or with --set of the sequences.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Write all sequences of this set, each into its own folder. train and test share their devices; transfer has
    /// others.
    #[arg(long, conflicts_with_all = ["seed", "minutes", "device"])]
    set: Option<Set>,
    /// Length of a sequence, min (1 to 600).
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=600))]
    minutes: u32,
    /// Seed of the route, the road, the noise and the biases at power-on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Seed of the sensors: gain, misalignment, and constant bias of the fibre-optic gyro.
    #[arg(long, default_value_t = 1)]
    device: u64,
}

pub fn run(args: &Args) -> super::Result {
    if let Some(set) = args.set {
        return set.specs().iter().try_for_each(|spec| write(spec, &args.out.join(&spec.name)));
    }
    let name = args.out.file_name().and_then(|name| name.to_str()).unwrap_or("simulated").to_owned();
    let (seconds, device, run) = (60 * args.minutes, args.device, args.seed);
    write(&Spec { name, seconds, device, run }, &args.out)
}

fn write(spec: &Spec, folder: &Path) -> super::Result {
    simulate::write(spec, folder).map_err(named(folder))?;
    let Spec { seconds, device, run, .. } = spec;
    Ok(remark(format_args!("{}: {seconds} s, device {device}, seed {run}", folder.display()))?)
}
