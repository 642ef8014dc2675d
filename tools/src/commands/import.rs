//! `gyronet import` converts logs of other tools to one drive, in Python.

use super::{Common, named, remark};
use gyronet_tools::python::package::package;
use gyronet_tools::target::bench::workspace;
use std::ffi::{OsStr, OsString};

/// Convert logs of other tools to one drive.
///
/// The package `gyronet` in Python reads the logs, with the libraries of those who keep the formats. The first call
/// makes an environment for it in the user's cache folder, in under a minute; it needs Python 3.11 or later.
/// `gyronet import --help` has the options.
#[derive(Debug, Clone, clap::Args)]
#[command(
    disable_help_flag = true,
    after_help = "\
Examples:
  gyronet import drive.bag --out drive.csv
  gyronet import drive.mcap bus.blf --dbc car.dbc --vehicle car.toml --out drive.csv"
)]
pub struct Args {
    /// Arguments of the Python package's command.
    #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Copy a ROS bag or MCAP file with the yaw rate that the board computes.
///
/// The package `gyronet` in Python writes it, as `pip install ./tools/python` installs it for `python3`, or for the
/// Python that `GYRONET_PYTHON` names. `gyronet correct --help` has the options.
#[derive(Debug, Clone, clap::Args)]
#[command(
    disable_help_flag = true,
    after_help = "Examples:\n  gyronet correct drive.mcap --out corrected.mcap"
)]
pub struct Correct {
    /// Arguments of the Python package's command.
    #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

pub fn correct(args: &Correct, common: Common) -> super::Result {
    python(&["correct"], &args.arguments, common)
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let sequence = match &args.arguments[..] {
        [layout, ..] if layout == "nclt" => {
            return Err("NCLT is not read any more; `cargo paper import` reads KAIST Complex Urban".into());
        }
        [layout, folder, ..] if layout == "kaist" => Some(folder),
        [folder, ..] if args.arguments.iter().any(|argument| argument == "--training") => Some(folder),
        _ => None,
    };
    if let Some(folder) = sequence {
        let folder = folder.display();
        return Err(format!("a sequence of a data set is imported by `cargo paper import {folder}`").into());
    }
    python(&["import"], &args.arguments, common)
}

/// Runs a command of the Python package, whose exit status becomes ours.
pub fn python(command: &[&str], arguments: &[OsString], common: Common) -> super::Result {
    let help = arguments.iter().any(|argument| argument == "--help" || argument == "-h");
    let needs = [command == ["correct"] && !help, help];
    let mut python = package(&workspace().join("tools/python"), needs, |environment| {
        let _ = remark(
            common,
            format_args!("makes the Python environment that reads logs, once: {}", environment.display()),
        );
    })?;
    python.args(command).args(arguments);
    let options = [("--json", common.json), ("--quiet", common.quiet)];
    python.args(options.into_iter().filter(|(_, given)| *given).map(|(option, _)| OsStr::new(option)));
    let started = python.env("GYRONET_COMMAND", "gyronet").status();
    let status = started.map_err(named(python.get_program().as_ref()))?;
    if status.success() {
        return Ok(());
    }
    // Python has said why.
    std::process::exit(status.code().unwrap_or(1))
}
