//! The `gyronet` command.

mod commands;

use clap::{Parser, Subcommand};
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Learned yaw-rate correction on a host: the very code that is flashed, on recorded drives.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: commands::Common,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(commands::demo::Args),
    Evaluate(commands::evaluate::Args),
    Replay(commands::replay::Args),
    Campaign(commands::campaign::Args),
    Simulate(commands::simulate::Args),
    Import(commands::import::Args),
    Tables(commands::tables::Args),
    Quantize(commands::quantize::Args),
    Monitor(commands::monitor::Args),
    Bus(commands::bus::Args),
    BenchTarget(commands::bench_target::Args),
    Device(commands::device::Args),
    Size(commands::size::Args),
    Soak(commands::soak::Args),
}

fn main() -> ExitCode {
    let Cli { command, common } = Cli::parse();
    let result = match &command {
        Command::Demo(args) => commands::demo::run(args, common),
        Command::Evaluate(args) => commands::evaluate::run(args, common),
        Command::Replay(args) => commands::replay::run(args, common),
        Command::Campaign(args) => commands::campaign::run(args, common),
        Command::Simulate(args) => commands::simulate::run(args, common),
        Command::Import(args) => commands::import::run(args, common),
        Command::Tables(args) => commands::tables::run(args, common),
        Command::Quantize(args) => commands::quantize::run(args, common),
        Command::Bus(args) => commands::bus::run(args, common),
        Command::Monitor(args) => commands::monitor::run(args, common),
        Command::BenchTarget(args) => commands::bench_target::run(args, common),
        Command::Device(args) => commands::device::run(args, common),
        Command::Size(args) => commands::size::run(args, common),
        Command::Soak(args) => commands::soak::run(args, common),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    // Who reads our output has seen enough: `gyronet replay FILE | head`.
    let closed = |error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe;
    if error.downcast_ref().is_some_and(closed) {
        return ExitCode::SUCCESS;
    }
    // Nothing is left to do where even stderr is gone.
    let _ = writeln!(std::io::stderr(), "error: {error}");
    ExitCode::FAILURE
}
