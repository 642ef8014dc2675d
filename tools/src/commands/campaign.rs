//! `gyronet campaign` injects faults into drives.

use super::weights::Weights;
use super::{Common, WriteError, print_json, progress, read_drive};
use gyronet::model::{Blob, weights};
use gyronet_tools::bundled;
use gyronet_tools::campaign::drive::Drive;
use gyronet_tools::campaign::networks::Integer;
use gyronet_tools::campaign::report::Report;
use gyronet_tools::campaign::scene::Scene;
use gyronet_tools::campaign::weight_upsets::WeightUpsets;
use gyronet_tools::campaign::{self, Plan, plot};
use gyronet_tools::parts::Part;
use std::fs;
use std::io::Write;
use std::path::PathBuf;

/// Inject faults into drives and count which ones a receiver detects.
///
/// The input is the bundled simulated drive and the given recordings, encoded as the bytes of four sensors and of
/// SLCAN lines. A seed draws faults, single and in pairs. A simulated receiver checks the board's CAN messages. The
/// command prints one line for each kind of fault.
///
/// The exit status is 1 if a fault that is not on the list of exceptions goes undetected, if anything panics, or if
/// an undamaged drive exceeds its error limits. With --upsets it is 1 if a damaged weight file is loaded, or a bit
/// that flips in use is not found.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet campaign --quick                              # half a minute
  gyronet campaign trial08_100hz.csv --plot faults.svg  # 20,000 runs
  gyronet campaign --upsets                             # flip bits of the weights")]
pub struct Args {
    /// Recordings to use in addition to the simulated drive.
    #[arg(value_name = "DRIVE.csv")]
    drives: Vec<PathBuf>,
    /// Number of runs, each of 8 s at most.
    #[arg(long, default_value_t = 20_000)]
    runs: usize,
    /// Seed; the same seed gives the same runs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Do 320 runs only.
    #[arg(long)]
    quick: bool,
    /// Flip bits of the weight file instead of damaging drives: every bit of its header, and this many bits of the
    /// weights.
    #[arg(long, value_name = "BITS", num_args = 0..=1, default_missing_value = "100000")]
    upsets: Option<usize>,
    /// Plot the runs with a single fault to this file.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = Weights::open(None)?;
    let blob = weights.blob()?;
    let mut drives = vec![Drive::new(&bundled::simulated_drive()?)];
    for path in &args.drives {
        drives.push(Drive::new(&read_drive(path, common)?));
    }
    if let Some(bits) = args.upsets {
        return upset(bits, args, &drives[0], common);
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let bar = progress::bar(common, drives.len() * Part::ALL.len(), "undamaged");
    let scenes = campaign::scenes(&drives, &blob, threads, || bar.inc(1));
    bar.finish_and_clear();
    let plan = Plan { runs: if args.quick { campaign::QUICK } else { args.runs }, seed: args.seed, threads };
    let bar = progress::bar(common, plan.runs, "faults");
    let runs = campaign::run(plan, &scenes, &blob, || bar.inc(1));
    bar.finish_and_clear();
    let report = Report::new(plan.seed, &scenes, &runs);
    let mut out = std::io::stdout().lock();
    if common.json {
        print_json(&mut out, &report)?;
    } else {
        write!(out, "{report}")?;
    }
    if let Some(path) = &args.plot {
        fs::write(path, plot::svg(&runs)?).map_err(WriteError::to(path))?;
    }
    match (report.failures.len(), report.out_of_order().count()) {
        (0, 0) => Ok(()),
        (0, drives) => Err(format!("{drives} undamaged drives exceed their error limits").into()),
        (count, _) => Err(format!("{count} of {} runs failed", plan.runs).into()),
    }
}

/// Number of windows that each damaged network estimates.
const WINDOWS: usize = 2;

fn upset(bits: usize, args: &Args, drive: &Drive, common: Common) -> super::Result {
    let file = &weights::DEFAULT.0;
    let blob = Blob::new_checked(file)?;
    let scene = Scene::new(drive, Part::Xsens, &mut Integer::new(blob));
    let mut windows: Vec<_> = scene.known.windows.keys().copied().collect();
    windows.sort_unstable();
    let windows: Vec<_> = windows.iter().step_by(windows.len() / WINDOWS).copied().take(WINDOWS).collect();
    let bar = progress::bar(common, bits, "upsets");
    let weights = WeightUpsets::new(file, &blob, &windows, (bits, args.seed), || bar.inc(1));
    bar.finish_and_clear();
    let mut out = std::io::stdout().lock();
    if common.json {
        print_json(&mut out, &weights)?;
    } else {
        write!(out, "{weights}")?;
    }
    let accepted =
        weights.header_bits - weights.header_refused + weights.weight_bits - weights.weight_refused;
    if accepted + weights.not_found > 0 {
        return Err(format!(
            "{accepted} damaged files were loaded, {} flips were not found in use",
            weights.not_found
        )
        .into());
    }
    Ok(())
}
