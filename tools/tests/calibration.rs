//! A unit's calibration: what `gyronet calibrate` writes, and `gyronet replay --calibration` applies.

use gyronet_tools::bundled::SIMULATED_DRIVE;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Returns whether the command succeeded, and its standard error.
fn gyronet(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gyronet"));
    let output = command.current_dir(folder).args(arguments).output().unwrap();
    (output.status.success(), String::from_utf8(output.stderr).unwrap())
}

/// A column of a table; an empty field is NaN.
fn column(path: &Path, at: usize) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().skip(1).map(|line| line.split(',').nth(at).unwrap());
    rows.map(|field| field.parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn replay_applies_the_gain_of_a_unit() {
    let folder = folder("calibration");
    std::fs::write(folder.join("drive.csv"), SIMULATED_DRIVE).unwrap();
    let (good, err) = gyronet(&folder, &["-q", "calibrate", "drive.csv", "--out", "unit.json"]);
    assert!(good, "{err}");
    // A gain of one per cent in place of what was found.
    let mut unit: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("unit.json")).unwrap()).unwrap();
    unit["gyro_map"] = serde_json::json!([[1, 0, 0], [0, 1, 0], [0, 0, 1.01]]);
    std::fs::write(folder.join("unit.json"), unit.to_string()).unwrap();
    let replay = |out: &str, more: &[&str]| {
        let (good, err) = gyronet(&folder, &[&["-q", "replay", "drive.csv", "--csv", out], more].concat());
        assert!(good, "{err}");
        column(&folder.join(out), 1)
    };
    let (plain, calibrated) = (replay("plain.csv", &[]), replay("unit.csv", &["--calibration", "unit.json"]));
    let turning = plain.iter().zip(&calibrated).filter(|(plain, _)| plain.abs() > 0.1);
    let ratios: Vec<f64> = turning.map(|(plain, calibrated)| calibrated / plain).collect();
    assert!(ratios.len() > 500 && ratios.iter().all(|ratio| (ratio - 1.01).abs() < 1e-4), "{}", ratios.len());

    unit["weights"] = serde_json::json!(1);
    std::fs::write(folder.join("unit.json"), unit.to_string()).unwrap();
    let (good, err) = gyronet(&folder, &["replay", "drive.csv", "--calibration", "unit.json"]);
    assert!(!good && err.contains("computed with the weights 00000001"), "{err}");
}

#[test]
fn nothing_that_was_found_is_no_file() {
    let folder = folder("calibration-nothing");
    // The vehicle stands for all of the drive, beside a reference of the same noise.
    let mut lines = SIMULATED_DRIVE.lines();
    let header = lines.next().unwrap();
    let at = |name: &str| header.split(',').position(|column| column == name).unwrap();
    let (gyro, reference) = (at("gyr_z"), at("ref_gyr_z"));
    let still: Vec<&str> = lines.take(250).collect();
    let mut text = header.to_owned() + "\n";
    for k in 0..6_000u32 {
        let mut fields: Vec<String> =
            still[7 * k as usize % still.len()].split(',').map(str::to_owned).collect();
        fields[0] = format!("{:.2}", 0.01 * f64::from(k));
        let rate: f64 = fields[gyro].parse().unwrap();
        fields[reference] = (rate + 1e-3 * f64::from(k * k).sin()).to_string();
        text += &(fields.join(",") + "\n");
    }
    std::fs::write(folder.join("drive.csv"), text).unwrap();
    let (good, err) = gyronet(&folder, &["-q", "calibrate", "drive.csv", "--out", "unit.json"]);
    assert!(!good && err.contains("unit.json: not written: nothing could be calibrated"), "{err}");
    assert!(!folder.join("unit.json").exists());
}
