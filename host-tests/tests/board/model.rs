//! The model of the STM32F405 itself: its own tests, and the image as it is flashed running on it.

use crate::common;
use gyronet_host_tests::board::PACKAGES;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require;
use gyronet_tools::target::stack::priorities;
use std::process::Command;

#[test]
fn model_passes_its_own_tests() {
    let Some(python) = require::python(PACKAGES) else { return };
    let output = Command::new(python)
        .args(["-m", "unittest", "discover", "--start-directory", "tests", "--top-level-directory", "."])
        .current_dir(workspace().join("host-tests/board"))
        .output()
        .expect("Python runs");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && words.contains("Ran "), "{words}");
    println!("{}", words.lines().rev().take(3).collect::<Vec<_>>().join(" "));
}

/// The image's own list of priorities, which the bound of the stack rests on, is what its code sets.
#[test]
fn priorities_are_those_that_the_stack_bound_rests_on() {
    let Some(elf) = common::elf() else { return };
    let Some(mut board) = common::started() else { return };
    let set = board.priorities();
    let listed = priorities(&std::fs::read(&elf).expect("it was just built")).expect("a firmware image");
    assert!(!listed.is_empty());
    for (number, priority) in listed {
        // The STM32F4 has the upper four bits of each byte; RTIC's 1 is the least urgent, 15.
        assert_eq!(16 - (set[number] >> 4), i64::from(priority), "exception {number}");
    }
}
