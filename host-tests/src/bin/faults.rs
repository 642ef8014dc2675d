//! Long runs of the fault harness: injected faults, or hours without a fault.

use clap::Parser;
use gyronet_host_tests::faults::drive::Drive;
use gyronet_host_tests::faults::report::Report;
use gyronet_host_tests::faults::{self, Plan, Run, soak};
use gyronet_tools::bundled;
use gyronet_tools::drive::recording::Recording;
use std::path::PathBuf;
use std::process::ExitCode;

/// Damage the bytes of drives and count what a receiver of the board's frames detects.
///
/// The exit status is 1 if a fault goes undetected that can be detected, if anything panics, if an undamaged drive
/// exceeds its error limits, or if a check of --soak fails.
#[derive(Parser)]
struct Args {
    /// Recordings to damage in addition to the bundled simulated drive.
    #[arg(value_name = "DRIVE.csv")]
    drives: Vec<PathBuf>,
    /// Number of runs, each of 8 s at most.
    #[arg(long, default_value_t = 20_000)]
    runs: usize,
    /// The same seed gives the same runs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Run so many simulated minutes without a fault instead, in which every clock and counter wraps.
    #[arg(long, value_name = "MINUTES", value_parser = clap::value_parser!(u64).range(1..=12_000))]
    soak: Option<u64>,
}

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let args = Args::parse();
    if let Some(minutes) = args.soak {
        let checks = soak::run(minutes * 60 * u64::from(gyronet::sample::RATE_HZ));
        for (what, holds) in &checks {
            println!("{} {what}", if *holds { "ok:    " } else { "FAILED:" });
        }
        return Ok(ExitCode::from(u8::from(checks.iter().any(|(_, holds)| !holds))));
    }
    let mut drives = vec![Drive::new(&bundled::simulated_drive()?)];
    for path in &args.drives {
        drives.push(Drive::new(&Recording::read(path)?));
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let scenes = faults::scenes(&drives, threads);
    let runs = faults::run(Plan { runs: args.runs, seed: args.seed, threads }, &scenes);
    print!("{}", Report(&scenes, &runs));
    let in_order =
        scenes.iter().filter_map(|scene| scene.baseline.against_truth()).all(|errors| errors.in_order);
    Ok(ExitCode::from(u8::from(!in_order || runs.iter().any(Run::is_failure))))
}
