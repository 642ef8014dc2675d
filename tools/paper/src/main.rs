//! The `gyronet-paper` command.
#![deny(
    clippy::print_stdout,
    reason = "it panics when the reader has closed the pipe: `gyronet-paper tables | head`"
)]

mod commands;

use clap::{Parser, Subcommand};
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Reproduce the paper's tables on sequences of KAIST Complex Urban.
///
/// A sequence is a folder in the layout of this data set, recorded or simulated. The file tools/paper/Makefile
/// trains, tests and compares on a whole data set with these commands.
#[derive(Debug, Parser)]
#[command(name = "gyronet-paper", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print results as JSON on standard output.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Simulate(commands::simulate::Args),
    Import(commands::import::Args),
    Tables(commands::tables::Args),
    Quantize(commands::quantize::Args),
}

fn main() -> ExitCode {
    let Cli { command, json } = Cli::parse();
    let result = match &command {
        Command::Simulate(args) => commands::simulate::run(args),
        Command::Import(args) => commands::import::run(args, json),
        Command::Tables(args) => commands::tables::run(args, json),
        Command::Quantize(args) => commands::quantize::run(args, json),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    let closed = |error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe;
    if error.downcast_ref().is_some_and(closed) {
        return ExitCode::SUCCESS;
    }
    // If even stderr is closed, the error cannot be reported.
    let _ = writeln!(std::io::stderr(), "error: {error}");
    ExitCode::FAILURE
}
