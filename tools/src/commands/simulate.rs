//! `gyronet simulate`: a drive that nobody drove.

use super::{Common, WriteError, progress};
use gyronet_tools::simulate::layout::{self, Layout, Set, Spec};
use gyronet_tools::simulate::{Config, csv};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Write a simulated drive: a car that stands, pulls away, bends, turns and stops, seen by a
/// MEMS part whose errors are known.
///
/// Without --layout: one CSV with the columns that the other subcommands read, with the true
/// rates in ref_gyr_*. With --layout: whole sequences of a drive through a town, in the folders
/// and formats of KAIST Complex Urban or NCLT, with a fibre-optic gyro and wheels; a file
/// simulated.json says that they are simulated. The same seed gives the same files on every
/// machine.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Where the drive goes: a file; with --layout a folder.
    #[arg(long, value_name = "PATH")]
    out: PathBuf,
    /// Length of a CSV drive, s.
    #[arg(long, default_value_t = 90, conflicts_with = "layout",
        value_parser = clap::value_parser!(u32).range(10..=36_000))]
    seconds: u32,
    /// Another route, road, noise and bias at power-on for each.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write a sequence in the layout of this data set.
    #[arg(long)]
    layout: Option<Layout>,
    /// Write all sequences of this set, each into a folder of its own: train and test share their
    /// devices, transfer has others.
    #[arg(long, requires = "layout", conflicts_with_all = ["seed", "minutes", "device"])]
    set: Option<Set>,
    /// Length of a sequence, min.
    #[arg(long, default_value_t = 20, requires = "layout", value_parser = clap::value_parser!(u32).range(1..=600))]
    minutes: u32,
    /// Seed of the parts: scale, misalignment, lasting bias.
    #[arg(long, default_value_t = 1, requires = "layout")]
    device: u64,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let Some(layout) = args.layout else { return drive(args) };
    if let Some(set) = args.set {
        for spec in set.specs(layout) {
            sequence(&spec, &args.out.join(&spec.name), common)?;
        }
        return Ok(());
    }
    let name = args.out.file_name().and_then(|name| name.to_str()).unwrap_or("simulated").to_owned();
    let seconds = 60 * args.minutes;
    sequence(&Spec { layout, name, seconds, device: args.device, run: args.seed }, &args.out, common)
}

fn drive(args: &Args) -> super::Result {
    let config = Config { seconds: args.seconds, seed: args.seed, ..Config::DEFAULT };
    let error = WriteError::to(&args.out);
    let file = File::create(&args.out).map_err(&error)?;
    let samples = csv::write(&config, BufWriter::new(file)).map_err(&error)?;
    writeln!(std::io::stderr(), "{}: {samples} samples, seed {}", args.out.display(), args.seed)?;
    Ok(())
}

fn sequence(spec: &Spec, folder: &Path, common: Common) -> super::Result {
    let bar = progress::bar(common, spec.seconds as usize, &spec.name);
    let mut ticks = 0;
    let written = layout::write(spec, folder, || {
        ticks += 1;
        if ticks % 100 == 0 {
            bar.inc(1);
        }
    });
    bar.finish_and_clear();
    written.map_err(WriteError::to(folder))?;
    let Spec { seconds, device, run, .. } = spec;
    writeln!(std::io::stderr(), "{}: {seconds} s, device {device}, seed {run}", folder.display())?;
    Ok(())
}
