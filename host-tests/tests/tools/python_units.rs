//! The unit tests of the Python packages. The trainer's, as far as they want no PyTorch: readers of drives and sequences,
//! vehicle files, filters of the rivals, errors of trajectories. Those of the import of logs.

use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require;
use std::process::Command;

#[test]
fn the_trainers_unit_tests_pass() {
    pass("the_trainers_unit_tests_pass", "tools/train", &["numpy", "scipy"], 52);
}

#[test]
fn the_unit_tests_of_the_import_in_python_pass() {
    let packages = ["asammdf", "can", "cantools", "mcap", "numpy", "pyulog", "rosbags"];
    pass("the_unit_tests_of_the_import_in_python_pass", "tools/python", &packages, 41);
}

/// Runs the unit tests of a folder, of which `least` must not be skipped.
fn pass(test: &str, folder: &str, packages: &[&str], least: usize) {
    let Some(python) = require::python(test, packages) else { return };
    let output = Command::new(python)
        .args([
            "-B",
            "-m",
            "unittest",
            "discover",
            "--start-directory",
            "tests",
            "--top-level-directory",
            ".",
        ])
        .current_dir(workspace().join(folder))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let ran = said.lines().find_map(|line| line.strip_prefix("Ran ")).expect("a count of tests");
    let ran: usize = ran.split(' ').next().unwrap().parse().unwrap();
    // A module that is skipped counts as one.
    let skipped = said
        .split_once("skipped=")
        .map_or(0, |(_, count)| count.trim_end().trim_end_matches(')').parse().unwrap());
    if skipped > 0 {
        require::skipped(test, &format!("{skipped} of {folder} want what is not here"));
    }
    assert!(ran - skipped >= least, "{said}");
}
