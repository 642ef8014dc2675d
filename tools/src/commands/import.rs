//! `gyronet import`: a sequence of a data set, converted to one drive.

use super::{Common, WriteError, print_json, progress, remark};
use gyronet_tools::drive::error::DataError;
use gyronet_tools::paper::sequence::{self, Sequence};
use gyronet_tools::paper::tables::pictures;
use gyronet_tools::simulate::layout::Layout;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Summarise a sequence of KAIST Urban or NCLT, and convert it to a CSV.
///
/// The other subcommands read the CSV.
///
/// KAIST has sensor_data/{xsens_imu,fog,encoder}.csv, calibration/EncoderParameter.txt and global_pose.csv; NCLT has
/// ms25.csv, kvh.csv, wheels.csv and groundtruth_*.csv. Missing files, wrong columns, text for numbers and time that
/// goes backwards are errors. Rows with NaN, repeated stamps, gaps and encoder resets are counted and reported.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet import kaist urban14 --out urban14.csv
  gyronet import nclt 2012-01-08 --stamps stamps.svg")]
pub struct Args {
    /// Data set whose layout the sequence has.
    #[arg(value_name = "LAYOUT")]
    layout: Layout,
    /// Folder of the sequence.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Write the drive, at 100 Hz, with gyro, wheels and truth to this file.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Write a picture of the times between stamps of each file (the paper's Fig. 11).
    #[arg(long, value_name = "FILE.svg")]
    stamps: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let started = Instant::now();
    let found = sequence::layout(&args.folder)?;
    if found != args.layout {
        return Err(format!("{}: has the layout of {found:?}", args.folder.display()).into());
    }
    let sequence = read(&args.folder, common)?;
    let mut out = std::io::stdout().lock();
    if common.json {
        let [imu, fog, wheels, truth] = &sequence.files;
        print_json(
            &mut out,
            &serde_json::json!({
                "name": sequence.name,
                "simulated": sequence.simulated,
                "seconds": sequence.seconds(),
                "files": { "imu": imu, "fog": fog, "wheels": wheels, "truth": truth },
                "steps_in_gap": sequence.in_gap,
            }),
        )?;
        return write(args, common, &sequence);
    }
    let simulated = if sequence.simulated.is_some() { " (simulated)" } else { "" };
    writeln!(out, "{}{simulated}: {:.2} s on the 100 Hz grid", sequence.name, sequence.seconds())?;
    for (file, in_gap) in sequence.files.iter().zip(sequence.in_gap) {
        write!(out, "  {file}")?;
        if in_gap > 0 {
            write!(out, ", {in_gap} steps in gaps over {:.0} ms", 1e3 * sequence::MAX_GAP)?;
        }
        writeln!(out)?;
    }
    write(args, common, &sequence)?;
    Ok(remark(common, format_args!("{:.2} s", started.elapsed().as_secs_f64()))?)
}

/// The files that are asked for.
fn write(args: &Args, common: Common, sequence: &Sequence) -> super::Result {
    if let Some(path) = &args.out {
        sequence.needs_gyro()?;
        let error = WriteError::to(path);
        let file = File::create(path).map_err(&error)?;
        let rows = sequence::write_csv(sequence, BufWriter::new(file)).map_err(&error)?;
        remark(common, format_args!("{}: {rows} rows", path.display()))?;
    }
    if let Some(path) = &args.stamps {
        std::fs::write(path, pictures::stamps(sequence)?).map_err(WriteError::to(path))?;
    }
    Ok(())
}

/// Reads a sequence under a progress bar.
pub(super) fn read(folder: &Path, common: Common) -> Result<Sequence, DataError> {
    let bar = progress::bar(common, sequence::size(folder) as usize, &folder.display().to_string());
    let sequence = Sequence::read(folder, |bytes| bar.set_position(bytes));
    bar.finish_and_clear();
    sequence
}
