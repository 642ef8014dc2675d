//! Some steps run Python programs of this repository: [`interpreter`] finds a Python interpreter for them, or creates
//! a virtual environment. [`package`] runs the package that reads logs.

pub mod package;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The reason why no Python interpreter can run a step.
#[derive(Debug, thiserror::Error)]
pub enum PythonError {
    #[error("{}: {source}", program.display())]
    Start { program: PathBuf, source: std::io::Error },
    #[error("{}: {reason} (needed: {})", python.display(), packages.join(", "))]
    Packages {
        python: PathBuf,
        /// The last line of the interpreter's error output.
        reason: String,
        /// All packages that the step needs.
        packages: Vec<String>,
    },
    #[error("{}: could not be created: {step} failed (without a network, pass --python with a Python that has all packages)", environment.display())]
    Environment { environment: PathBuf, step: &'static str },
    #[error(
        "logs are read by Python, and python3 cannot be started ({source}): install Python 3.11 or later, or set GYRONET_PYTHON"
    )]
    NoPython { source: std::io::Error },
    #[error(
        "logs are read by Python 3.11 or later, and python3 is older: set GYRONET_PYTHON to a later one with tools/python/requirements.txt"
    )]
    OldPython,
    #[error(
        "this needs the Python package gyronet {version}, which python3 does not have: pip install ./tools/python in gyronet's repository"
    )]
    NoPackage { version: &'static str },
    #[error("{}: {source}", folder.display())]
    Folder { folder: PathBuf, source: std::io::Error },
    #[error(
        "the Python packages that read logs could not be installed: {step}: {reason} (without a network: pip install -r tools/python/requirements.txt from a mirror, and GYRONET_PYTHON)"
    )]
    Install { step: &'static str, reason: String },
}

/// Returns an interpreter that can import all `packages`: `given`, or else that of the virtual environment. A missing
/// or incomplete environment is created and `requirements` are installed. pip prints to standard error.
pub fn interpreter(
    given: Option<&Path>,
    environment: &Path,
    requirements: &Path,
    packages: &[&str],
) -> Result<PathBuf, PythonError> {
    if let Some(python) = given {
        return imports(python, packages).map(|()| python.to_owned());
    }
    let python = environment.join("bin/python");
    if python.exists() && imports(&python, packages).is_ok() {
        return Ok(python);
    }
    let made = |step, command: &mut Command| match run(command)? {
        true => Ok(()),
        false => Err(PythonError::Environment { environment: environment.to_owned(), step }),
    };
    made("python3 -m venv", Command::new("python3").args(["-m", "venv"]).arg(environment))?;
    let install = ["-m", "pip", "install", "--disable-pip-version-check", "-r"];
    made("pip install", Command::new(&python).args(install).arg(requirements))?;
    imports(&python, packages).map(|()| python)
}

/// Runs a command with its output on standard error; returns whether it succeeded.
fn run(command: &mut Command) -> Result<bool, PythonError> {
    let status = command.stdout(Stdio::from(std::io::stderr())).status();
    let program = || command.get_program().into();
    Ok(status.map_err(|source| PythonError::Start { program: program(), source })?.success())
}

fn imports(python: &Path, packages: &[&str]) -> Result<(), PythonError> {
    let import = format!("import {}", packages.join(", "));
    let output = Command::new(python).args(["-c", &import]).output();
    let output = output.map_err(|source| PythonError::Start { program: python.to_owned(), source })?;
    if output.status.success() {
        return Ok(());
    }
    let reason = last_line(&output.stderr);
    let packages = packages.iter().map(|package| (*package).to_owned()).collect();
    Err(PythonError::Packages { python: python.to_owned(), reason, packages })
}

fn last_line(said: &[u8]) -> String {
    let text = String::from_utf8_lossy(said);
    text.trim().lines().last().unwrap_or("ended without a message").to_owned()
}
