//! `gyronet import`: a sequence of a data set as one drive.

use super::{Common, WriteError, progress};
use gyronet_tools::figures;
use gyronet_tools::sequence::{self, Sequence};
use gyronet_tools::simulate::layout::Layout;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Read a sequence of KAIST Complex Urban or NCLT, say what is in it, and write it as one CSV that
/// the other subcommands run.
///
/// KAIST: sensor_data/{xsens_imu,fog,encoder}.csv, calibration/EncoderParameter.txt and
/// global_pose.csv. NCLT: ms25.csv, kvh.csv, wheels.csv and groundtruth_*.csv. Missing files,
/// wrong columns, text for numbers and time going backwards are errors; rows with NaN, repeated
/// stamps, gaps and encoder resets are counted and said.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Whose layout it has.
    #[arg(value_name = "LAYOUT")]
    layout: Layout,
    /// Folder of the sequence.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Write the drive, at 100 Hz, with gyro, wheels and truth.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Draw the times between stamps of each file (the paper's Fig. 11).
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
    let simulated = if sequence.simulated.is_some() { " (simulated)" } else { "" };
    writeln!(out, "{}{simulated}: {:.2} s on the 100 Hz grid", sequence.name, sequence.seconds())?;
    for (file, in_gap) in sequence.files.iter().zip(sequence.in_gap) {
        write!(out, "  {file}")?;
        if in_gap > 0 {
            write!(out, ", {in_gap} steps in gaps over {:.0} ms", 1e3 * sequence::MAX_GAP)?;
        }
        writeln!(out)?;
    }
    if let Some(path) = &args.out {
        sequence.needs_gyro()?;
        let error = WriteError::to(path);
        let file = File::create(path).map_err(&error)?;
        let rows = sequence::write_csv(&sequence, BufWriter::new(file)).map_err(&error)?;
        writeln!(out, "{}: {rows} rows", path.display())?;
    }
    if let Some(path) = &args.stamps {
        std::fs::write(path, figures::stamps(&sequence)?).map_err(WriteError::to(path))?;
    }
    writeln!(out, "{:.2} s", started.elapsed().as_secs_f64())?;
    Ok(())
}

/// Reads a sequence under a progress bar.
pub(super) fn read(folder: &Path, common: Common) -> Result<Sequence, sequence::SequenceError> {
    let bar = progress::bar(common, sequence::size(folder) as usize, &folder.display().to_string());
    let sequence = Sequence::read(folder, |bytes| bar.set_position(bytes));
    bar.finish_and_clear();
    sequence
}
