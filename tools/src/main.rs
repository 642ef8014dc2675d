//! The `gyronet` command.
#![deny(
    clippy::print_stdout,
    reason = "it panics when the reader has closed the pipe: `gyronet size | head`"
)]

mod commands;

use clap::{CommandFactory, Parser, Subcommand};
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Replay drives through gyronet's firmware code; configure and monitor boards.
///
/// Start with `gyronet demo`. `gyronet import` converts logs of other tools to a
/// drive, and `gyronet doctor` checks a drive.
///
/// A drive is a CSV file with a header, of 50 to 1000 Hz, best 100. The vehicle must stand still
/// for the first 3 s. Columns may be in any order; other columns are ignored:
///
///   t_s                    time, s
///   acc_x, acc_y, acc_z    specific force, m/s^2 (x forward, y left, z up)
///   gyr_x, gyr_y, gyr_z    angular rate, rad/s
///   ref_gyr_z              true yaw rate, rad/s; optional
///   ref_yaw                course over ground by GNSS, rad, left positive;
///                          optional, empty where unknown
///   course, gnss_speed     what the board gets of a GNSS receiver: course clockwise from
///                          north, rad, and speed, m/s; optional; or instead of both
///   gnss_lat, gnss_lon     position, deg
///   temp_c                 temperature of the sensor, deg C; optional
///   wheel1_rate ..4        wheel rates, rad/s; optional
///                          (front right, rear right, front left, rear left)
///
/// Errors can be computed only with ref_gyr_z or ref_yaw.
#[derive(Debug, Parser)]
#[command(
    name = "gyronet",
    version,
    arg_required_else_help = true,
    verbatim_doc_comment,
    after_help = "\
Exit status: 0 success; 1 failure or failed check (standard error has the reason);
2 wrong arguments.
Colours and progress appear on a terminal only; NO_COLOR=1 turns colours off."
)]
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
    Calibrate(commands::calibrate::Args),
    Replay(commands::replay::Args),
    Simulate(commands::simulate::Args),
    Import(commands::import::Args),
    Correct(commands::import::Correct),
    Doctor(commands::doctor::Args),
    Quantize(commands::quantize::Args),
    BenchTarget(commands::bench_target::Args),
    Device(commands::device::Args),
    Keys(commands::keys::Args),
    Sign(commands::sign::Args),
    Reference(commands::reference::Args),
    Wheels(commands::wheels::Args),
    Size(commands::size::Args),
    Firmware(commands::firmware::Args),
    Completions(commands::completions::Args),
}

fn main() -> ExitCode {
    let Cli { command, common } = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => match commands::retired::line(&error) {
            Some(line) => return fail(&line, 2),
            None => error.exit(),
        },
    };
    let result = match &command {
        Command::Demo(args) => commands::demo::run(args, common),
        Command::Evaluate(args) => commands::evaluate::run(args, common),
        Command::Calibrate(args) => commands::calibrate::run(args, common),
        Command::Replay(args) => commands::replay::run(args, common),
        Command::Keys(args) => commands::keys::run(args, common),
        Command::Sign(args) => commands::sign::run(args, common),
        Command::Reference(args) => commands::reference::run(args, common),
        Command::Simulate(args) => commands::simulate::run(args, common),
        Command::Import(args) => commands::import::run(args, common),
        Command::Correct(args) => commands::import::correct(args, common),
        Command::Doctor(args) => commands::doctor::run(args, common),
        Command::Quantize(args) => commands::quantize::run(args, common),
        Command::BenchTarget(args) => commands::bench_target::run(args, common),
        Command::Device(args) => commands::device::run(args, common),
        Command::Wheels(args) => commands::wheels::run(args, common),
        Command::Size(args) => commands::size::run(args, common),
        Command::Firmware(args) => commands::firmware::run(args, common),
        Command::Completions(args) => commands::completions::run(args, Cli::command()),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    // The reader of our output has closed the pipe: `gyronet replay FILE | head`.
    let closed = |error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe;
    if error.downcast_ref().is_some_and(closed) {
        return ExitCode::SUCCESS;
    }
    fail(&error, 1)
}

fn fail(error: &dyn std::fmt::Display, status: u8) -> ExitCode {
    // If even stderr is closed, the error cannot be reported.
    let mark = console::style("error:").for_stderr().red().bold();
    let _ = writeln!(std::io::stderr(), "{mark} {error}");
    ExitCode::from(status)
}
