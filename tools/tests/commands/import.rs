//! The commands that Python does: `gyronet import` and `gyronet wheels from-dbc` find it, or make an environment for it.
//!
//! A shell script stands for Python; it makes environments that hold itself, and prints how it was called.

use super::{command, scratch, text};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Output;

const PYTHON: &str = r#"#!/bin/sh
echo "$*" >> "$CALLS"
case "$1 $2" in
    "-c "*) exit "${TOO_OLD:-0}" ;;
    "-EP -c") echo "$INSTALLED" ;;
    "-m venv") mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
    "-m pip") [ -z "$OFFLINE" ] || { printf 'trying\nERROR: no route\n' >&2; exit 1; } ;;
    "-m gyronet") echo "$0|$PYTHONPATH|$*"; echo 'said by Python' >&2; exit 3 ;;
esac
"#;

struct Machine {
    folder: PathBuf,
}

impl Machine {
    fn new(name: &str) -> Self {
        let folder = scratch(&format!("import-{name}"));
        std::fs::create_dir(folder.join("bin")).unwrap();
        let python = folder.join("bin/python3");
        std::fs::write(&python, PYTHON).unwrap();
        std::fs::set_permissions(&python, PermissionsExt::from_mode(0o755)).unwrap();
        Self { folder }
    }

    /// Runs the command with variables, and returns what it printed and how often the script was called.
    fn run(&self, arguments: &[&str], variables: &[(&str, &str)]) -> (Output, Vec<String>) {
        let calls = self.folder.join("calls");
        let _ = std::fs::remove_file(&calls);
        let output = command(arguments)
            .env_remove("GYRONET_PYTHON")
            .env_remove("PYTHONPATH")
            .env("XDG_CACHE_HOME", self.folder.join("cache"))
            .env("PATH", format!("{}:/usr/bin:/bin", self.folder.join("bin").display()))
            .env("CALLS", &calls)
            .envs(variables.iter().copied())
            .output()
            .unwrap();
        let calls = std::fs::read_to_string(&calls).unwrap_or_default();
        (output, calls.lines().map(str::to_owned).collect())
    }

    fn environment(&self) -> PathBuf {
        self.folder.join("cache/gyronet/python")
    }
}

/// One line on standard error, and status 1.
fn refused(output: &Output) -> String {
    let error = text(&output.stderr);
    assert_eq!((output.status.code(), error.trim().lines().count()), (Some(1), 1), "{error}");
    error
}

#[test]
fn an_environment_is_made_once_and_arguments_and_status_pass_through() {
    let machine = Machine::new("made");
    let (output, calls) = machine.run(&["import", "a.bag", "--from", "-1", "--out", "a b.csv"], &[]);
    let python = machine.environment().join("bin/python");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    let ran =
        |arguments: &str| format!("{}|{}|-m gyronet {arguments}\n", python.display(), sources.display());
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert_eq!(text(&output.stdout), ran("import a.bag --from -1 --out a b.csv"));
    assert!(text(&output.stderr).ends_with("said by Python\n"), "{output:?}");
    assert!(text(&output.stderr).contains("makes the Python environment"), "{output:?}");
    assert_eq!(calls.len(), 5, "{calls:?}");

    // It is there now.
    let (output, calls) = machine.run(&["--json", "-q", "wheels", "from-dbc", "car.dbc", "--help"], &[]);
    assert_eq!(text(&output.stdout), ran("wheels from-dbc car.dbc --help --json --quiet"));
    assert_eq!((text(&output.stderr), calls.len()), ("said by Python\n".to_owned(), 1), "{calls:?}");

    // Another version of the command needed other packages.
    std::fs::write(machine.environment().join("made-of.txt"), "rosbags==0.1\n").unwrap();
    std::fs::write(machine.environment().join("old"), "").unwrap();
    let (output, calls) = machine.run(&["import", "a.bag"], &[]);
    assert_eq!(text(&output.stdout), ran("import a.bag"));
    assert!(
        calls.iter().any(|call| call.starts_with("-m pip")) && !machine.environment().join("old").exists()
    );
}

#[test]
fn a_python_with_the_package_is_used_as_it_is() {
    let machine = Machine::new("installed");
    let installed = [("INSTALLED", env!("CARGO_PKG_VERSION"))];
    let (output, calls) = machine.run(&["import", "a.bag"], &installed);
    assert!(text(&output.stdout).ends_with("bin/python3||-m gyronet import a.bag\n"), "{output:?}");
    assert_eq!(calls.len(), 2, "{calls:?}");
    let given = machine.folder.join("given");
    std::fs::copy(machine.folder.join("bin/python3"), &given).unwrap();
    let correct = ["correct", "a.bag", "--out", "b.bag"];
    let (output, calls) = machine.run(&correct, &[("GYRONET_PYTHON", given.to_str().unwrap())]);
    assert!(text(&output.stdout).starts_with(given.to_str().unwrap()), "{output:?}");
    assert!(text(&output.stdout).ends_with("-m gyronet correct a.bag --out b.bag\n"), "{output:?}");
    assert_eq!(calls.len(), 2, "{calls:?}");
    let (output, _) = machine.run(&["import", "a.bag"], &[("GYRONET_PYTHON", "/nowhere/python")]);
    assert!(refused(&output).contains("/nowhere/python: No such file"));
    // The board is in the installed package alone.
    let (output, _) = machine.run(&correct, &installed);
    assert!(
        text(&output.stdout).ends_with("bin/python3||-m gyronet correct a.bag --out b.bag\n"),
        "{output:?}"
    );
    let (output, _) = machine.run(&correct, &[]);
    assert!(refused(&output).contains("pip install ./tools/python"));
    // Its help needs nothing.
    let (output, calls) = machine.run(&["correct", "--help"], &[]);
    assert!(text(&output.stdout).ends_with("/tools/python|-m gyronet correct --help\n"), "{output:?}");
    assert_eq!(calls.len(), 2, "{calls:?}");
    // An older one is not.
    let (_, calls) = machine.run(&["import", "a.bag"], &[("INSTALLED", "0.0.1")]);
    assert!(calls.iter().any(|call| call.starts_with("-m venv")), "{calls:?}");
}

#[test]
fn without_python_or_network_one_line_says_so_and_nothing_is_left() {
    let machine = Machine::new("offline");
    let (output, _) = machine.run(&["-q", "import", "a.bag"], &[("OFFLINE", "1")]);
    let error = refused(&output);
    assert!(error.contains("pip install: ERROR: no route") && error.contains("GYRONET_PYTHON"), "{error}");
    assert!(!machine.environment().exists());
    let (output, _) = machine.run(&["-q", "import", "a.bag"], &[("TOO_OLD", "1")]);
    assert!(refused(&output).contains("Python 3.11 or later, and python3 is older"));
    let (output, _) = machine.run(&["-q", "import", "a.bag"], &[("PATH", "/nowhere")]);
    assert!(refused(&output).contains("python3 cannot be started"));
    assert!(!machine.environment().exists());
}
