//! Formats that `gyronet import` leaves to Python: refused with a command, which is run here as it stands in the message,
//! and whose result is imported.

use crate::imported::{Imported, import};
use gyronet_host_tests::recordings::{folder, workspace};
use gyronet_host_tests::require::{Need, python, wants};
use gyronet_tools::bundled;
use gyronet_tools::drive::vehicle::Vehicle;
use gyronet_tools::import::drive::Request;
use std::path::{Path, PathBuf};
use std::process::Command;

fn request(file: PathBuf, toml: &str) -> Request {
    let vehicle = Vehicle::parse("vehicle.toml", toml).unwrap();
    Request { files: vec![file], vehicle, ..Request::default() }
}

/// Runs a command line of Python's packages in a folder.
fn run(python: &str, arguments: &[&str], folder: &Path) {
    let output = Command::new(python).args(arguments).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_ros_2_bag_in_sqlite_is_converted_by_the_command_in_the_message() {
    let test = "a_ros_2_bag_in_sqlite_is_converted_by_the_command_in_the_message";
    let Some(python) = python(test, &["rosbags"]) else { return };
    let bag = self::folder().join("logs/jackal.bag");
    let found = if bag.is_file() { Ok(bag) } else { Err("no logs/jackal.bag".to_owned()) };
    let Some(bag) = wants(test, Need::Data, found) else { return };
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let bag_path = bag.to_str().unwrap();
    let converter = ["-m", "rosbags.convert"];
    run(
        &python,
        &[&converter[..], &["--src", bag_path, "--dst", "drive", "--dst-storage", "sqlite3"]].concat(),
        folder,
    );

    let refused = import(&request(folder.join("drive/drive.db3"), "")).unwrap_err().to_string();
    let (_, command) = refused.split_once("&& rosbags-convert ").expect("a command");
    let command = command.replace("FOLDER", "drive").replace("CONVERTED", "converted");
    run(&python, &[&converter[..], &command.split(' ').collect::<Vec<_>>()].concat(), folder);
    let converted = import(&request(folder.join("converted/converted.mcap"), "")).unwrap();
    let direct = import(&request(bag, "")).unwrap();
    assert!(converted.rows.len() == 6_121 && converted.rows == direct.rows, "{:?}", converted.report);
}

#[test]
fn an_mf4_is_converted_by_the_command_in_the_message() {
    let test = "an_mf4_is_converted_by_the_command_in_the_message";
    let Some(python) = python(test, &["asammdf"]) else { return };
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let script = workspace().join("host-tests/tests/clients/make_mf4.py");
    let drive = workspace().join("tools/data/simulated_drive.csv");
    run(&python, &[script.to_str().unwrap(), drive.to_str().unwrap(), "drive.mf4"], folder);

    let refused = import(&request(folder.join("drive.mf4"), "")).unwrap_err().to_string();
    let program = refused.split('"').nth(1).expect("a program in quotation marks");
    run(&python, &["-c", &program.replace("FILE", "drive.mf4")], folder);
    let columns = ["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"]
        .map(|name| format!("{name} = {{ name = 'IMU_{name}' }}\n"));
    let toml = format!(
        "[wheels]\nradius_m = 0.3\nrear_right = 'WheelSpeedRR'\n[columns]\n{}wheel = {{ name = 'WheelSpeedRR', unit = 'km/h' }}\n",
        columns.concat()
    );
    let Imported { rows, report, dropped } = import(&request(folder.join("drive.mf4.csv"), &toml)).unwrap();
    assert_eq!((rows.len(), dropped), (9_000, 0), "{report:?}");
    for (row, truth) in rows.iter().zip(&bundled::simulated_drive().unwrap().rows) {
        assert!((row.imu[5] - truth.sample.angular_rate[2].rad_per_sec()).abs() < 1e-6, "{row:?}");
        // The wheel's stamps lie 3 ms after the rows.
        let wheel = row.wheels[1].expect("a wheel");
        assert!((wheel - truth.wheels[1].unwrap()).abs() < 0.3, "{row:?}");
    }
}
