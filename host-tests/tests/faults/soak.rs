//! Four minutes of a drive in which every clock and counter wraps, in a process of its own, because it measures memory.

use std::process::Command;

#[test]
fn every_clock_and_counter_wraps_without_loss_or_drift() {
    let soak = Command::new(env!("CARGO_BIN_EXE_faults")).args(["--soak", "4"]).output().expect("it runs");
    let text = String::from_utf8_lossy(&soak.stdout);
    println!("{text}");
    assert!(soak.status.success(), "{text}{}", String::from_utf8_lossy(&soak.stderr));
    assert_eq!(text.lines().filter(|line| line.starts_with("ok:")).count(), 13);
}
