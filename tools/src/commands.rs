//! The subcommands, one file each. They parse arguments, call the library, and write text and files. This file holds
//! the code that they share.

pub mod bench_target;
pub mod calibrate;
pub mod completions;
pub mod demo;
pub mod device;
pub mod doctor;
mod drives;
pub mod evaluate;
pub mod firmware;
pub mod import;
pub mod keys;
mod paint;
mod progress;
pub mod quantize;
pub mod reference;
pub mod replay;
pub mod retired;
pub mod sign;
pub mod simulate;
pub mod size;
mod weights;
pub mod wheels;

use gyronet_tools::drive::error::{DataError, named};
use gyronet_tools::drive::stream::Drive;
use std::error::Error;

/// The result of a subcommand. The library's errors are typed; here an error only needs to print as one clear line
/// that names the file.
pub type Result = std::result::Result<(), Box<dyn Error>>;

fn print_json(out: &mut impl std::io::Write, value: &impl serde::Serialize) -> Result {
    serde_json::to_writer_pretty(&mut *out, value).map_err(std::io::Error::from)?;
    Ok(writeln!(out)?)
}

/// Prints a result as JSON or as text.
fn print(common: Common, json: &impl serde::Serialize, text: impl std::fmt::Display) -> Result {
    use std::io::Write;
    let out = &mut std::io::stdout().lock();
    if common.json { print_json(out, json) } else { Ok(writeln!(out, "{text}")?) }
}

/// Writes a remark to standard error, unless --quiet is given.
fn remark(common: Common, line: std::fmt::Arguments<'_>) -> std::io::Result<()> {
    use std::io::Write;
    if common.quiet { Ok(()) } else { writeln!(std::io::stderr(), "{line}") }
}

/// Prints a remark if the drive has a vehicle file beside it.
fn remarked(drive: Drive<'static>, common: Common) -> std::result::Result<Drive<'static>, DataError> {
    if let Some(vehicle) = &drive.vehicle.path {
        remark(common, format_args!("{}: vehicle file {}", drive.path, vehicle.display()))
            .map_err(|error| DataError::of("standard error", error.into()))?;
    }
    Ok(drive)
}

/// The options of all subcommands.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Common {
    /// Print results and errors only: no progress, no remarks.
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Print results as JSON on standard output.
    #[arg(long, global = true)]
    pub json: bool,
}
