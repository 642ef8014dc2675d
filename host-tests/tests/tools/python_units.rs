//! The unit tests of the Python packages. The trainer's, as far as they want no PyTorch: readers of drives and sequences,
//! vehicle files, filters of the rivals, errors of trajectories. Those of the package `gyronet`: import, and the board.

use gyronet::coprocessor::Config;
use gyronet::model::GyroNet;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require;
use gyronet_tools::board::Board;
use gyronet_tools::bundled;
use gyronet_tools::drive::candump::Log;
use gyronet_tools::drive::export;
use gyronet_tools::drive::replay::Steps;
use gyronet_tools::drive::stream::Drive;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::Command;

#[test]
fn the_trainers_unit_tests_pass() {
    let Some(python) = require::python(&["numpy", "scipy"]) else { return };
    let folder = workspace().join("tools/python");
    pass(Command::new(python).arg("-B").current_dir(folder), "gyronet_train/tests", 39);
}

/// `GYRONET_WHEEL` is set where the wheel is installed in `GYRONET_PYTHON`: then it is tested, not the sources.
#[test]
fn the_unit_tests_of_the_python_package_pass() {
    let folder = workspace().join("tools/python");
    let mut packages = vec!["asammdf", "can", "cantools", "mcap", "numpy", "pyulog", "rosbags"];
    let wheel = std::env::var_os("GYRONET_WHEEL").is_some();
    packages.extend(wheel.then_some("gyronet._core"));
    let Some(python) = require::python(&packages) else { return };
    let (mut command, replay) = (Command::new(python), tempfile::tempdir().unwrap());
    replayed(replay.path());
    command.arg("-B").current_dir(folder.join("tests")).env("GYRONET_REPLAY", replay.path());
    if !wheel {
        command.env("PYTHONPATH", &folder);
    }
    pass(&mut command, ".", if wheel { 63 } else { 53 });
}

/// Writes the log and the table of `gyronet replay` for the simulated drive.
fn replayed(folder: &Path) {
    let recording = bundled::simulated_drive().unwrap();
    let drive = Drive::from(&recording);
    let network = GyroNet::shipped().unwrap();
    let file = |name| BufWriter::new(File::create(folder.join(name)).unwrap());
    let (mut log, mut table) = (Log::new(file("can.log")), file("rates.csv"));
    writeln!(table, "{}", export::HEADER).unwrap();
    for step in Steps::new(&drive, Board::new(Config::DEFAULT, drive.wheels(), network)).unwrap() {
        let step = step.unwrap();
        step.frames.iter().for_each(|sent| log.frame(sent.time, &sent.frame).unwrap());
        export::line(&step, &mut table).unwrap();
    }
    log.finish().unwrap();
    table.flush().unwrap();
}

/// Runs the unit tests in a folder of the command's, of which `least` must not be skipped.
fn pass(python: &mut Command, tests: &str, least: usize) {
    let discover = ["-m", "unittest", "discover", "--start-directory", tests, "--top-level-directory", "."];
    let output = python.args(discover).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let ran = said.lines().find_map(|line| line.strip_prefix("Ran ")).expect("a count of tests");
    let ran: usize = ran.split(' ').next().unwrap().parse().unwrap();
    // A module that is skipped counts as one.
    let skipped = said
        .split_once("skipped=")
        .map_or(0, |(_, count)| count.trim_end().trim_end_matches(')').parse().unwrap());
    if skipped > 0 {
        require::skipped(&format!("{skipped} unit tests were skipped"));
    }
    assert!(ran - skipped >= least, "{said}");
}
