//! The Python package `gyronet` (tools/python), which reads logs: where it is, and the light environment that runs it.
//!
//! In order: the Python that `GYRONET_PYTHON` names; the environment in the user's cache folder; the package as `pip`
//! installed it for `python3`. In a checkout, whose sources are run where the package is not installed, a missing or
//! outdated environment is made. The board needs the package as `pip` installs it, which compiles it.

use super::{PythonError, last_line};
use crate::drive::error::named;
use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

const REQUIREMENTS: &str = include_str!("../../requirements.txt");
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The file of an environment that holds its requirements; written last.
const STAMP: &str = "made-of.txt";

/// Returns `python -m gyronet` without arguments, with the `board`, for logs alone, or to print `help`, which needs
/// nothing but the sources. `sources` is the package's folder in a checkout. `remark` gets a line before an environment
/// is made.
pub fn package(
    sources: &Path,
    [board, help]: [bool; 2],
    remark: impl FnOnce(&Path),
) -> Result<Command, PythonError> {
    let sources = Some(sources).filter(|folder| folder.join("gyronet").is_dir());
    let named = std::env::var_os("GYRONET_PYTHON").map(PathBuf::from);
    let python = named.clone().unwrap_or_else(|| "python3".into());
    let light = named.is_none() && !board && sources.is_some();
    let environment = cache().map(|cache| cache.join("python")).filter(|_| light);
    let made = environment.as_ref().filter(|environment| is_current(environment));
    let (python, sources) = if let Some(environment) = made {
        (interpreter(environment), sources)
    } else if is_installed(&python) {
        (python, None)
    } else if (named.is_some() || help) && sources.is_some() {
        (python, sources)
    } else if let Some(environment) = &environment {
        remark(environment);
        (make(environment)?, sources)
    } else {
        return Err(PythonError::NoPackage { python, version: VERSION });
    };
    let mut command = Command::new(python);
    command.args(["-m", "gyronet"]);
    if let Some(sources) = sources {
        let inherited = std::env::var_os("PYTHONPATH").map(PathBuf::from);
        let paths = std::env::join_paths([sources].into_iter().chain(inherited.as_deref()));
        command.env("PYTHONPATH", paths.unwrap_or_else(|_| sources.into()));
    }
    Ok(command)
}

fn cache() -> Option<PathBuf> {
    let variable =
        |name: &str| std::env::var_os(name).filter(|value: &OsString| !value.is_empty()).map(PathBuf::from);
    let cache = variable("XDG_CACHE_HOME").or_else(|| variable("LOCALAPPDATA"));
    Some(cache.or_else(|| Some(variable("HOME")?.join(".cache")))?.join("gyronet"))
}

fn interpreter(environment: &Path) -> PathBuf {
    environment.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" })
}

fn is_current(environment: &Path) -> bool {
    // The interpreter is a link to one that may have been removed.
    std::fs::read_to_string(environment.join(STAMP)).is_ok_and(|made_of| made_of == REQUIREMENTS)
        && interpreter(environment).exists()
}

/// Checks for the package of this version among those of a Python.
fn is_installed(python: &Path) -> bool {
    let program = "import importlib.metadata as m; print(m.version('gyronet'))";
    let output = Command::new(python).args(["-EP", "-c", program]).output();
    output.is_ok_and(|output| output.status.success() && output.stdout.trim_ascii() == VERSION.as_bytes())
}

/// Makes the environment, or waits until another process has made it, and returns its interpreter.
fn make(environment: &Path) -> Result<PathBuf, PythonError> {
    let version = ["-c", "import sys; sys.exit(sys.version_info < (3, 11))"];
    let old = Command::new("python3").args(version).status();
    if !old.map_err(|source| PythonError::NoPython { source })?.success() {
        return Err(PythonError::OldPython);
    }
    let folder = named(environment);
    let parent = environment.parent().unwrap_or(environment);
    std::fs::create_dir_all(parent).map_err(&folder)?;
    let lock = File::create(environment.with_extension("lock")).map_err(&folder)?;
    lock.lock().map_err(&folder)?;
    let python = interpreter(environment);
    if is_current(environment) {
        return Ok(python);
    }
    if environment.exists() {
        std::fs::remove_dir_all(environment).map_err(&folder)?;
    }
    let result = install(environment, &python);
    if result.is_err() {
        let _ = std::fs::remove_dir_all(environment);
    }
    result.map(|()| python)
}

fn install(environment: &Path, python: &Path) -> Result<(), PythonError> {
    let folder = named(environment);
    let run = |step, command: &mut Command| -> Result<(), PythonError> {
        let output = command.output().map_err(&folder)?;
        let said = [output.stdout, output.stderr].concat();
        let failed = || PythonError::Install { step, reason: last_line(&said) };
        output.status.success().then_some(()).ok_or_else(failed)
    };
    run(
        "python3 -m venv (on Debian: apt install python3-venv)",
        Command::new("python3").args(["-m", "venv"]).arg(environment),
    )?;
    let requirements = environment.join("requirements.txt");
    std::fs::write(&requirements, REQUIREMENTS).map_err(&folder)?;
    let pip = "-m pip install --quiet --disable-pip-version-check --no-compile --retries 1 -r";
    run("pip install", Command::new(python).args(pip.split(' ')).arg(&requirements))?;
    Ok(std::fs::rename(&requirements, environment.join(STAMP)).map_err(&folder)?)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_package_has_the_version_of_the_command() {
        let project = concat!(env!("CARGO_MANIFEST_DIR"), "/python/pyproject.toml");
        let project = std::fs::read_to_string(project).unwrap();
        assert!(project.contains(&format!("\nversion = \"{}\"\n", super::VERSION)), "{project}");
    }
}
