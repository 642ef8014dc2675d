//! `gyronet quantize`: an f32 checkpoint becomes a weight file for the integer kernels.

use super::{Common, WriteError};
use gyronet::fog::FogConfig;
use gyronet::model::fognet::FogNetState;
use gyronet::model::{FogNet, GyroNet};
use gyronet::pipeline::PipelineConfig;
use gyronet_tools::bundled;
use gyronet_tools::checkpoint::Checkpoint;
use gyronet_tools::drive::Drive;
use gyronet_tools::fog_checkpoint::{self, FogCheckpoint};
use gyronet_tools::fog_drive;
use gyronet_tools::quantization_error::Both;
use gyronet_tools::quantize::{Report, fognet, quantize};
use gyronet_tools::recording::Recording;
use gyronet_tools::sequence::Sequence;
use gyronet_tools::weight_file::WeightFile;
use std::path::PathBuf;

/// Turns a checkpoint (safetensors, from tools/train) into a weight file: int8 rows, packed in
/// the order in which the kernels read them, with its provenance and a CRC-32. Which network it
/// is the checkpoint says.
///
/// Prints the error that quantisation adds: RMS of integer less f32 output over RMS of the f32
/// output, on the drives given, or for GyroNet on the simulated drive that comes with this tool.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The checkpoint.
    checkpoint: PathBuf,
    /// The weight file to write.
    #[arg(long, short)]
    out: PathBuf,
    /// Recordings to measure the error on; for FoGNet folders in the layout of KAIST or NCLT.
    #[arg(long, num_args = 1.., value_name = "PATH")]
    drives: Vec<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args, _common: Common) -> super::Result {
    let (bytes, report) =
        if fog_checkpoint::is_fognet(&args.checkpoint)? { fognet(args)? } else { gyronet(args)? };
    std::fs::write(&args.out, &bytes).map_err(WriteError::to(&args.out))?;
    let Report { rows, raised, largest_raise, bytes } = report;
    println!(
        "{raised} of {rows} rows have a larger scale to keep their sum in 24 bits, at most {largest_raise:.2}x"
    );
    println!("{}: {bytes} bytes", args.out.display());
    Ok(())
}

/// A weight file and how it was made.
type Made = Result<(Vec<u8>, Report), Box<dyn std::error::Error>>;

fn gyronet(args: &Args) -> Made {
    let checkpoint = Checkpoint::read(&args.checkpoint)?;
    let (bytes, report) = quantize(&checkpoint)?;
    let weights = WeightFile::parse(&args.out.display().to_string(), &bytes)?;
    let drives = if args.drives.is_empty() {
        vec![bundled::simulated_drive()?]
    } else {
        args.drives.iter().map(|path| Recording::read(path)).collect::<Result<_, _>>()?
    };
    for drive in &drives {
        let (mut integer, mut reference) = (GyroNet::new(weights.blob()?), checkpoint.network());
        let mut both = Both::new(&mut integer, &mut reference);
        Drive::run(drive, &PipelineConfig::DEFAULT, None, &mut both, || {})?;
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
    Ok((bytes, report))
}

fn fognet(args: &Args) -> Made {
    let checkpoint = FogCheckpoint::read(&args.checkpoint)?;
    let (bytes, report) = fognet::quantize(&checkpoint)?;
    let weights = WeightFile::parse_fognet(&args.out.display().to_string(), &bytes)?;
    for path in &args.drives {
        let sequence = Sequence::read(path, |_| {})?;
        let mut state = FogNetState::ZERO;
        let (mut integer, mut reference) =
            (FogNet::new(weights.fog_blob()?, &mut state), checkpoint.network());
        let mut both = Both::new(&mut integer, &mut reference);
        fog_drive::run(&sequence, &mut both, FogConfig::DEFAULT, || {});
        let error = both.error();
        println!(
            "{}: quantisation adds {:.2} % RMS over {} windows, {} inputs clamped",
            sequence.name,
            100.0 * error.relative_rms(),
            error.windows,
            error.clamped_inputs
        );
    }
    Ok((bytes, report))
}
