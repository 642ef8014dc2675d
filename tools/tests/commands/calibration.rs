//! A unit's calibration: what `gyronet calibrate` writes, and `gyronet replay --calibration` applies.

use super::{column, gyronet_in, scratch};
use gyronet_tools::bundled::SIMULATED_DRIVE;

#[test]
fn replay_applies_the_gain_of_a_unit() {
    let folder = scratch("calibration");
    std::fs::write(folder.join("drive.csv"), SIMULATED_DRIVE).unwrap();
    gyronet_in(&folder, &["-q", "calibrate", "drive.csv", "--out", "unit.json"]).unwrap();
    // A gain of one per cent in place of what was found.
    let mut unit: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("unit.json")).unwrap()).unwrap();
    unit["gyro_map"] = serde_json::json!([[1, 0, 0], [0, 1, 0], [0, 0, 1.01]]);
    std::fs::write(folder.join("unit.json"), unit.to_string()).unwrap();
    let replay = |out: &str, more: &[&str]| {
        gyronet_in(&folder, &[&["-q", "replay", "drive.csv", "--csv", out], more].concat()).unwrap();
        column(&folder.join(out), ',', 1)
    };
    let (plain, calibrated) = (replay("plain.csv", &[]), replay("unit.csv", &["--calibration", "unit.json"]));
    let turning = plain.iter().zip(&calibrated).filter(|(plain, _)| plain.abs() > 0.1);
    let ratios: Vec<f64> = turning.map(|(plain, calibrated)| calibrated / plain).collect();
    assert!(ratios.len() > 500 && ratios.iter().all(|ratio| (ratio - 1.01).abs() < 1e-4), "{}", ratios.len());

    unit["weights"] = serde_json::json!(1);
    std::fs::write(folder.join("unit.json"), unit.to_string()).unwrap();
    let err = gyronet_in(&folder, &["replay", "drive.csv", "--calibration", "unit.json"]).unwrap_err();
    assert!(err.contains("computed with the weights 00000001"), "{err}");
}

#[test]
fn nothing_that_was_found_is_no_file() {
    let folder = scratch("calibration-nothing");
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
    let err = gyronet_in(&folder, &["-q", "calibrate", "drive.csv", "--out", "unit.json"]).unwrap_err();
    assert!(err.contains("unit.json: not written: nothing could be calibrated"), "{err}");
    assert!(!folder.join("unit.json").exists());
}
