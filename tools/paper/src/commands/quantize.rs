//! `gyronet-paper quantize` converts a checkpoint of FoGNet to a weight file for the integer kernels.

use super::print_json;
use gyronet::fog::FogConfig;
use gyronet::model::FogNet;
use gyronet::model::fognet::FogNetState;
use gyronet_paper::fog_replay;
use gyronet_paper::sequence::Sequence;
use gyronet_tools::network::checkpoint::{self, Checkpoint};
use gyronet_tools::network::quantization_error::Both;
use gyronet_tools::network::quantize::{Report, fognet};
use gyronet_tools::network::weight_file::WeightFile;
use std::io::Write;
use std::path::PathBuf;

/// Convert a checkpoint of FoGNet to an int8 weight file.
///
/// With --drives the command also prints the error that quantisation adds on each sequence: the RMS of the difference
/// between integer and f32 output, divided by the RMS of the f32 output.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  gyronet-paper quantize fognet.safetensors --out fognet.blob --drives sequences/train08")]
pub struct Args {
    /// Checkpoint (safetensors, from gyronet_train).
    checkpoint: PathBuf,
    /// Weight file to write.
    #[arg(long, short, value_name = "BLOB")]
    out: PathBuf,
    /// Sequences on which the error is measured.
    #[arg(long, num_args = 1.., value_name = "DIR")]
    drives: Vec<PathBuf>,
}

pub fn run(args: &Args, json: bool) -> super::Result {
    let checkpoint = Checkpoint::<checkpoint::FogNet>::read(&args.checkpoint)?;
    let (bytes, Report { rows, raised, largest_raise, .. }) = fognet::quantize(&checkpoint)?;
    let weights = WeightFile::parse_fognet(&args.out.display().to_string(), &bytes)?;
    let (mut errors, mut text) = (Vec::new(), String::new());
    for path in &args.drives {
        let sequence = Sequence::read(path)?;
        let mut state = FogNetState::ZERO;
        let (mut integer, mut reference) =
            (FogNet::new(weights.fog_blob()?, &mut state), checkpoint.network());
        let mut both = Both::new(&mut integer, &mut reference);
        fog_replay::run(&sequence, &mut both, FogConfig::DEFAULT);
        let (error, name) = (both.error(), &sequence.name);
        let (added, windows, clamped) = (error.relative_rms(), error.windows, error.clamped_inputs);
        text += &format!(
            "{name}: quantisation adds {:.2} % RMS over {windows} windows, {clamped} inputs clamped\n",
            100.0 * added
        );
        errors.push(serde_json::json!({
            "drive": name, "windows": windows, "relative_rms": added, "clamped_inputs": clamped,
        }));
    }
    super::write(&args.out, &bytes)?;
    if json {
        return print_json(&serde_json::json!({
            "path": args.out, "bytes": bytes.len(), "rows": rows, "raised_rows": raised,
            "largest_raise": largest_raise, "drives": errors,
        }));
    }
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{text}{raised} of {rows} rows have a larger scale to keep their sum in 24 bits, at most {largest_raise:.2}x"
    )?;
    Ok(writeln!(out, "{}: {} bytes", args.out.display(), bytes.len())?)
}
