//! `gyronet simulate` writes simulated drives and sequences.

use super::{Common, WriteError, print_json, progress, remark};
use gyronet_tools::simulate::layout::{self, Layout, Set, Spec};
use gyronet_tools::simulate::{Config, csv};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Write a simulated drive whose sensor errors are known.
///
/// A car stands, pulls away, follows bends, turns and stops; a MEMS sensor with known errors measures its motion.
///
/// Without --layout the command writes one CSV file with the columns that the other commands read, and the true rates
/// in ref_gyr_*. With --layout it writes sequences of a drive through a town, in the folders and formats of KAIST
/// Complex Urban or NCLT, with a fibre-optic gyro and wheels; a file simulated.json marks them as simulated. The same
/// seed gives the same files on every machine.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet simulate --seconds 600 --seed 7 --out drive.csv
  gyronet simulate --layout kaist --set test --out sequences      # four sequences of 20 min")]
pub struct Args {
    /// Write the drive to this file, or with --layout to this folder.
    #[arg(long, value_name = "PATH")]
    out: PathBuf,
    /// Length of a CSV drive, s (10 to 36000).
    #[arg(long, default_value_t = 90, conflicts_with = "layout",
        value_parser = clap::value_parser!(u32).range(10..=36_000))]
    seconds: u32,
    /// Seed of the route, the road, the noise and the bias at power-on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write a sequence in the layout of this data set.
    #[arg(long)]
    layout: Option<Layout>,
    /// Write all sequences of this set, each into its own folder. train and test share their devices; transfer has
    /// others.
    #[arg(long, requires = "layout", conflicts_with_all = ["seed", "minutes", "device"])]
    set: Option<Set>,
    /// Length of a sequence, min (1 to 600).
    #[arg(long, default_value_t = 20, requires = "layout", value_parser = clap::value_parser!(u32).range(1..=600))]
    minutes: u32,
    /// Seed of the sensors: gain, misalignment, and constant bias of the fibre-optic gyro.
    #[arg(long, default_value_t = 1, requires = "layout")]
    device: u64,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let Some(layout) = args.layout else { return drive(args, common) };
    if let Some(set) = args.set {
        let specs = set.specs(layout).into_iter().map(|spec| (args.out.join(&spec.name), spec));
        return sequences(specs.collect(), common);
    }
    let name = args.out.file_name().and_then(|name| name.to_str()).unwrap_or("simulated").to_owned();
    let seconds = 60 * args.minutes;
    let spec = Spec { layout, name, seconds, device: args.device, run: args.seed };
    sequences(vec![(args.out.clone(), spec)], common)
}

fn drive(args: &Args, common: Common) -> super::Result {
    let config = Config { seconds: args.seconds, seed: args.seed, ..Config::DEFAULT };
    let error = WriteError::to(&args.out);
    let file = File::create(&args.out).map_err(&error)?;
    let samples = csv::write(&config, BufWriter::new(file)).map_err(&error)?;
    let (path, seed) = (args.out.display(), args.seed);
    if common.json {
        let written = serde_json::json!({ "path": args.out, "samples": samples, "seed": seed });
        return print_json(&mut std::io::stdout().lock(), &written);
    }
    Ok(remark(common, format_args!("{path}: {samples} samples, seed {seed}"))?)
}

fn sequences(all: Vec<(PathBuf, Spec)>, common: Common) -> super::Result {
    for (folder, spec) in &all {
        sequence(spec, folder, common)?;
    }
    let written = |(folder, spec): &(PathBuf, Spec)| serde_json::json!({ "path": folder, "spec": spec });
    if common.json {
        let all: Vec<_> = all.iter().map(written).collect();
        print_json(&mut std::io::stdout().lock(), &all)?;
    }
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
    Ok(remark(common, format_args!("{}: {seconds} s, device {device}, seed {run}", folder.display()))?)
}
