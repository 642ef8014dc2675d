//! `gyronet train` trains weights on a folder of drives, and measures what they gain.

use super::weights::Sent;
use super::{Common, WriteError, drives, paint, print_json, remark};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::report::Report;
use gyronet_tools::network::checkpoint::{Checkpoint, GyroNet};
use gyronet_tools::network::quantize::quantize;
use gyronet_tools::python;
use gyronet_tools::target::bench;
use gyronet_tools::train::examine::Examined;
use gyronet_tools::train::roles::Roles;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Train weights on a folder of drives, and show what they gain.
///
/// The input is a folder of drives (CSV files of any name, with ref_gyr_z). They train GyroNet in PyTorch, which is
/// installed into .venv of the workspace the first time. Drives are sorted by name: the last quarter is held out, and
/// the drive before it chooses the epoch. --hold-out and --validate select others. A drive that cannot be used is
/// left out, and the reason is printed; a folder with too little data is an error.
///
/// The output is a weight file and a checkpoint. The command also prints the errors on the held-out drives, as
/// `gyronet evaluate` does.
///
/// To continue a training that was stopped or killed, run the same command again.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet train drives
  gyronet train drives --hold-out monday friday --validate sunday --out mine
  gyronet train drives --seeds 1 2 3 --python /usr/bin/python3")]
pub struct Args {
    /// Folder of drives.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Folder for gyronet.blob, gyronet.safetensors and the training state [default: target/train].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Drives that are held out for the final evaluation, by name or a unique part of it.
    #[arg(long, num_args = 1.., value_name = "NAME")]
    hold_out: Vec<String>,
    /// Drive that chooses the best epoch and seed.
    #[arg(long, value_name = "NAME")]
    validate: Option<String>,
    /// Largest number of passes over the training drives.
    #[arg(long, default_value_t = 20, value_name = "N")]
    epochs: u32,
    /// Stop after this many epochs without improvement.
    #[arg(long, default_value_t = 6, value_name = "N")]
    patience: u32,
    /// Seeds to train with; the best on the validation drive is kept.
    #[arg(long, num_args = 1.., default_values_t = [1], value_name = "N")]
    seeds: Vec<u64>,
    /// Python with the packages of tools/python/gyronet_train/requirements.txt [default: .venv of the workspace, created if
    /// missing].
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let roles = Roles::choose(&args.folder, args.validate.as_deref(), &args.hold_out)?;
    for refusal in &roles.refused {
        remark(common, format_args!("left out: {refusal}"))?;
    }
    let names = |drives: &[Examined]| drives.iter().map(|drive| drive.name.clone()).collect::<Vec<_>>();
    remark(
        common,
        format_args!(
            "trains: {}; chooses: {}; held out: {}",
            names(&roles.train).join(" "),
            roles.validate.name,
            names(&roles.held_out).join(" ")
        ),
    )?;
    let out = args.out.clone().unwrap_or_else(|| bench::workspace().join("target/train"));
    std::fs::create_dir_all(&out).map_err(WriteError::to(&out))?;
    python_training(args, common, &roles, &out)?;

    let [checkpoint, blob] = ["gyronet.safetensors", "gyronet.blob"].map(|name| out.join(name));
    let (bytes, _) = quantize(&Checkpoint::<GyroNet>::read(&checkpoint)?)?;
    std::fs::write(&blob, &bytes).map_err(WriteError::to(&blob))?;
    let sent = Sent { weights: Some(blob.clone()) };
    let files: Vec<PathBuf> = roles.held_out.iter().map(|drive| drive.path.clone()).collect();
    let report = Report::new(drives::errors(&files, common, |file, bar| {
        let drive = Drive::open(file)?;
        bar.set_length(drive.facts.rows as u64);
        sent.errors(&drive, None, |_| bar.inc(1))
    })?);
    let mut stdout = std::io::stdout().lock();
    if common.json {
        let refused: Vec<String> = roles.refused.iter().map(ToString::to_string).collect();
        let json = serde_json::json!({
            "train": names(&roles.train), "validate": roles.validate.name, "refused": refused,
            "held_out": report, "files": { "weights": blob },
        });
        return print_json(&mut stdout, &json);
    }
    write!(stdout, "{}", paint::report(&report))?;
    Ok(writeln!(
        stdout,
        "weights: {} ({} bytes; `gyronet device weights` uploads them to a board)",
        blob.display(),
        bytes.len()
    )?)
}

/// Trains in Python, whose progress bar and lines are shown on standard error.
fn python_training(args: &Args, common: Common, roles: &Roles, out: &Path) -> super::Result {
    let (environment, source) = (bench::workspace().join(".venv"), bench::workspace().join("tools/python"));
    let requirements = source.join("gyronet_train/requirements.txt");
    let packages = ["torch", "numpy", "safetensors", "tqdm"];
    let python = python::interpreter(args.python.as_deref(), &environment, &requirements, &packages)?;
    let mut command = Command::new(&python);
    command.env("PYTHONPATH", source);
    command.args(["-m", "gyronet_train"]).arg(&args.folder).arg("--out").arg(out);
    command.args(["--validate", &roles.validate.name]);
    command.arg("--train").args(roles.train.iter().map(|drive| &drive.name));
    for (option, value) in [("--epochs", args.epochs), ("--patience", args.patience)] {
        command.args([option, &value.to_string()]);
    }
    command.arg("--seeds").args(args.seeds.iter().map(ToString::to_string));
    if common.quiet {
        command.env("TQDM_DISABLE", "1").stdout(Stdio::null());
    } else {
        command.stdout(Stdio::from(std::io::stderr()));
    }
    let status = command.status().map_err(WriteError::to(&python))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("training stopped ({status}); the reason is printed above").into())
    }
}
