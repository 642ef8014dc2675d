//! The subcommands, one file each, and the code that they share.

pub mod import;
pub mod quantize;
pub mod simulate;
pub mod tables;

use gyronet_tools::drive::error::named;
use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::Path;

/// The result of a subcommand; an error is one line that names the file.
pub type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

fn print_json(value: &impl serde::Serialize) -> Result {
    let mut out = std::io::stdout().lock();
    serde_json::to_writer_pretty(&mut out, value).map_err(std::io::Error::from)?;
    Ok(writeln!(out)?)
}

fn remark(line: std::fmt::Arguments<'_>) -> std::io::Result<()> {
    writeln!(std::io::stderr(), "{line}")
}

fn write(path: &Path, content: impl AsRef<[u8]>) -> Result {
    Ok(fs::write(path, content).map_err(named(path))?)
}
