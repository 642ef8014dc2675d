//! `gyronet simulate`: a drive that nobody drove.

use super::{Common, WriteError};
use gyronet_tools::simulate::{Config, csv};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Write a simulated drive: a car that stands, pulls away, bends, turns and stops, seen by a
/// MEMS part whose errors are known.
///
/// The file has the columns that the other subcommands read, with the true rates in ref_gyr_*.
/// The same seed gives the same file on every machine.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Where the drive goes.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Length, s.
    #[arg(long, default_value_t = 90, value_parser = clap::value_parser!(u32).range(10..=36_000))]
    seconds: u32,
    /// Another route, road and part for each.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs the subcommand.
pub fn run(args: &Args, _common: Common) -> super::Result {
    let config = Config { seconds: args.seconds, seed: args.seed, ..Config::DEFAULT };
    let error = WriteError::to(&args.out);
    let file = File::create(&args.out).map_err(&error)?;
    let samples = csv::write(&config, BufWriter::new(file)).map_err(&error)?;
    writeln!(std::io::stderr(), "{}: {samples} samples, seed {}", args.out.display(), args.seed)?;
    Ok(())
}
