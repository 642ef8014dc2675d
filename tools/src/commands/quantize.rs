//! `gyronet quantize` converts an f32 checkpoint to a weight file for the integer kernels.

use super::{Common, named, print};
use gyronet_tools::network::checkpoint::{self, Checkpoint};
use gyronet_tools::network::quantize::quantize;
use std::path::PathBuf;

/// Convert an f32 checkpoint to an int8 weight file for the board.
///
/// The input is a checkpoint of GyroNet (safetensors, from gyronet_train). The weight file has int8 rows,
/// packed in the order in which the kernels read them, with its provenance and a CRC-32.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet quantize gyronet.safetensors --out gyronet.blob")]
pub struct Args {
    /// Checkpoint (safetensors).
    checkpoint: PathBuf,
    /// Weight file to write.
    #[arg(long, short, value_name = "BLOB")]
    out: PathBuf,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let bytes = quantize(&Checkpoint::<checkpoint::GyroNet>::read(&args.checkpoint)?)?;
    std::fs::write(&args.out, &bytes).map_err(named(&args.out))?;
    let (path, bytes) = (&args.out, bytes.len());
    let json = serde_json::json!({ "path": path, "bytes": bytes });
    print(common, &json, format_args!("{}: {bytes} bytes", path.display()))
}
