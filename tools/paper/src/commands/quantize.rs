//! `gyronet-paper quantize` converts a checkpoint of FoGNet to a weight file for the integer kernels.

use super::print_json;
use gyronet_tools::network::checkpoint::{self, Checkpoint};
use gyronet_tools::network::quantize::fognet::quantize;
use std::io::Write;
use std::path::PathBuf;

/// Convert a checkpoint of FoGNet to an int8 weight file.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  gyronet-paper quantize fognet.safetensors --out fognet.blob")]
pub struct Args {
    /// Checkpoint (safetensors, from gyronet_train).
    checkpoint: PathBuf,
    /// Weight file to write.
    #[arg(long, short, value_name = "BLOB")]
    out: PathBuf,
}

pub fn run(args: &Args, json: bool) -> super::Result {
    let bytes = quantize(&Checkpoint::<checkpoint::FogNet>::read(&args.checkpoint)?)?;
    super::write(&args.out, &bytes)?;
    if json {
        return print_json(&serde_json::json!({ "path": args.out, "bytes": bytes.len() }));
    }
    Ok(writeln!(std::io::stdout().lock(), "{}: {} bytes", args.out.display(), bytes.len())?)
}
