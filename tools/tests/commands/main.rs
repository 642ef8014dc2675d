//! The command `gyronet` as its user runs it.

mod calibration;
mod command_line;
mod demo;
#[cfg(target_os = "linux")]
mod drive_memory;
#[cfg(unix)]
mod import;
mod settings;
mod vehicle_file;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gyronet"));
    command.args(arguments);
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn gyronet(arguments: &[&str]) -> Output {
    command(arguments).output().unwrap()
}

/// Runs the command in a folder. Returns its standard error, as an error if it failed.
fn gyronet_in(folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = command(arguments).current_dir(folder).output().unwrap();
    if output.status.success() { Ok(text(&output.stderr)) } else { Err(text(&output.stderr)) }
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn column(path: &Path, separator: char, at: usize) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().filter_map(|line| line.split(separator).nth(at)?.parse().ok()).collect()
}
