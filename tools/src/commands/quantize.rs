//! `gyronet quantize`: an f32 checkpoint becomes a weight file for the integer kernels.

use super::{Common, WriteError};
use gyronet::model::GyroNet;
use gyronet_tools::bundled;
use gyronet_tools::checkpoint::Checkpoint;
use gyronet_tools::drive::Drive;
use gyronet_tools::quantization_error::Both;
use gyronet_tools::quantize::{Report, quantize};
use gyronet_tools::recording::Recording;
use gyronet_tools::weight_file::WeightFile;
use std::path::PathBuf;

/// Turns a checkpoint (safetensors, from tools/train) into a weight file: int8 rows, packed in
/// the order in which the kernels read them, with its provenance and a CRC-32.
///
/// Prints the error that quantisation adds: RMS of integer less f32 output over RMS of the f32
/// output, on the drives given, or on the simulated drive that comes with this tool.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The checkpoint.
    checkpoint: PathBuf,
    /// The weight file to write.
    #[arg(long, short)]
    out: PathBuf,
    /// Recordings to measure the error on.
    #[arg(long, num_args = 1.., value_name = "FILE")]
    drives: Vec<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args, _common: Common) -> super::Result {
    let checkpoint = Checkpoint::read(&args.checkpoint)?;
    let (bytes, report) = quantize(&checkpoint)?;
    let weights = WeightFile::parse(&args.out.display().to_string(), &bytes)?;
    let drives = if args.drives.is_empty() {
        vec![bundled::simulated_drive()?]
    } else {
        args.drives.iter().map(|path| Recording::read(path)).collect::<std::result::Result<_, _>>()?
    };
    for drive in &drives {
        let (mut integer, mut reference) = (GyroNet::new(weights.blob()?), checkpoint.network());
        let mut both = Both::new(&mut integer, &mut reference);
        Drive::run(drive, &mut both, || {})?;
        let error = both.error();
        println!(
            "{}: quantisation adds {:.2} % RMS ({:.2} % to the scale) over {} windows, {} inputs clamped",
            drive.name(),
            100.0 * error.relative_rms(),
            100.0 * error.scale_rms(),
            error.windows,
            error.clamped_inputs
        );
    }
    std::fs::write(&args.out, &bytes).map_err(WriteError::to(&args.out))?;
    let Report { rows, raised, largest_raise, bytes } = report;
    println!(
        "{raised} of {rows} rows have a larger scale to keep their sum in 24 bits, at most {largest_raise:.2}x"
    );
    println!("{}: {bytes} bytes", args.out.display());
    Ok(())
}
