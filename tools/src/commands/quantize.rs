//! `gyronet quantize` converts an f32 checkpoint to a weight file for the integer kernels.

use super::{Common, WriteError, print_json, remarked};
use gyronet::coprocessor::Config;
use gyronet::model::GyroNet;
use gyronet_tools::board::Board;
use gyronet_tools::bundled;
use gyronet_tools::drive::replay::{Steps, initialise};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::network::checkpoint::{self, Checkpoint};
use gyronet_tools::network::quantization_error::Both;
use gyronet_tools::network::quantize::{Report, quantize};
use gyronet_tools::network::weight_file::WeightFile;
use serde::Serialize;
use std::fmt;
use std::io::Write;
use std::path::PathBuf;

/// Convert an f32 checkpoint to an int8 weight file for the board.
///
/// The input is a checkpoint of GyroNet (safetensors, from gyronet_train). The weight file has int8 rows,
/// packed in the order in which the kernels read them, with its provenance and a CRC-32.
///
/// The command also prints the error that quantisation adds: the RMS of the difference between integer and f32
/// output, divided by the RMS of the f32 output. It is measured on the given drives; the default is the
/// simulated drive that comes with the tools.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet quantize gyronet.safetensors --out gyronet.blob --drives trial08.csv")]
pub struct Args {
    /// Checkpoint (safetensors).
    checkpoint: PathBuf,
    /// Weight file to write.
    #[arg(long, short, value_name = "BLOB")]
    out: PathBuf,
    /// Drives on which the error is measured.
    #[arg(long, num_args = 1.., value_name = "PATH")]
    drives: Vec<PathBuf>,
}

/// The error that quantisation adds on one drive.
#[derive(Serialize)]
struct Added {
    drive: String,
    windows: u64,
    relative_rms: f64,
    clamped_inputs: u64,
}

impl fmt::Display for Added {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { drive, windows, relative_rms, clamped_inputs } = self;
        write!(
            f,
            "{drive}: quantisation adds {:.2} % RMS over {windows} windows, {clamped_inputs} inputs clamped",
            100.0 * relative_rms
        )
    }
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let (bytes, report, added) = convert(args, common)?;
    std::fs::write(&args.out, &bytes).map_err(WriteError::to(&args.out))?;
    let Report { rows, raised, largest_raise, bytes } = report;
    let mut out = std::io::stdout().lock();
    if common.json {
        let made = serde_json::json!({
            "path": args.out, "bytes": bytes, "rows": rows, "raised_rows": raised, "largest_raise": largest_raise,
            "drives": added,
        });
        return print_json(&mut out, &made);
    }
    added.iter().try_for_each(|added| writeln!(out, "{added}"))?;
    writeln!(
        out,
        "{raised} of {rows} rows have a larger scale to keep their sum in 24 bits, at most {largest_raise:.2}x"
    )?;
    Ok(writeln!(out, "{}: {bytes} bytes", args.out.display())?)
}

/// The bytes of a weight file, the quantisation's report, and the error that it adds on each drive.
type Made = Result<(Vec<u8>, Report, Vec<Added>), Box<dyn std::error::Error>>;

fn convert(args: &Args, common: Common) -> Made {
    let checkpoint = Checkpoint::<checkpoint::GyroNet>::read(&args.checkpoint)?;
    let (bytes, report) = quantize(&checkpoint)?;
    let weights = WeightFile::parse(&args.out.display().to_string(), &bytes)?;
    let bundled = bundled::simulated_drive()?;
    let drives: Vec<Drive<'_>> = if args.drives.is_empty() {
        vec![Drive::from(&bundled)]
    } else {
        args.drives.iter().map(|path| remarked(Drive::open(path)?, common)).collect::<Result<_, _>>()?
    };
    let mut added = Vec::new();
    for drive in &drives {
        let (mut integer, mut reference) = (GyroNet::new(weights.blob()?), checkpoint.network());
        let mut both = Both::new(&mut integer, &mut reference);
        initialise(drive)?;
        Steps::new(drive, Board::new(Config::DEFAULT, None, &mut both))?
            .try_for_each(|step| step.map(drop))?;
        let error = both.error();
        added.push(Added {
            drive: drive.name().into(),
            windows: error.windows,
            relative_rms: error.relative_rms(),
            clamped_inputs: error.clamped_inputs,
        });
    }
    Ok((bytes, report, added))
}
