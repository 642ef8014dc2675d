//! The trainer's own unit tests, as far as they want no PyTorch: readers of drives and sequences, vehicle files, filters of
//! the rivals, errors of trajectories.

use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require;
use std::process::Command;

/// Tests that need no PyTorch, at least.
const LEAST: usize = 52;

#[test]
fn the_trainers_unit_tests_pass() {
    let test = "the_trainers_unit_tests_pass";
    let Some(python) = require::python(test, &["numpy", "scipy"]) else { return };
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
        .current_dir(workspace().join("tools/train"))
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
        require::skipped(test, &format!("{skipped} modules of the trainer's want PyTorch"));
    }
    assert!(ran - skipped >= LEAST, "{said}");
}
