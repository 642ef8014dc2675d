//! The vehicle file beside a drive: `drive.toml` beside `drive.csv`, read by every command.

use super::{column, gyronet_in, scratch};
use gyronet_tools::bundled::SIMULATED_DRIVE;
use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

/// Makes a folder with 25 s of the simulated drive as a sensor that hangs upside down records it, and its vehicle file.
fn folder(name: &str, vehicle: &str) -> PathBuf {
    let folder = scratch(name);
    let mut lines = SIMULATED_DRIVE.lines().take(2_501);
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let turned = ["acc_y", "acc_z", "gyr_y", "gyr_z"];
    let row = |line: &str| {
        let fields = header.iter().zip(line.split(',')).map(|(name, field)| {
            if turned.contains(name) {
                (-field.parse::<f64>().unwrap()).to_string()
            } else {
                field.to_owned()
            }
        });
        fields.collect::<Vec<_>>().join(",") + "\n"
    };
    std::fs::write(folder.join("drive.csv"), header.join(",") + "\n" + &lines.map(row).collect::<String>())
        .unwrap();
    std::fs::write(folder.join("drive.toml"), vehicle).unwrap();
    folder
}

#[test]
fn mounting_and_radius_are_used_and_named() {
    let folder = folder("vehicle_file", "[mounting]\nroll_deg = 180\n[wheels]\nradius_m = 0.578\n");
    std::fs::write(folder.join("plain.csv"), SIMULATED_DRIVE).unwrap();
    let err =
        gyronet_in(&folder, &["replay", "drive.csv", "--csv", "rates.csv", "--tum", "path.tum"]).unwrap();
    assert!(err.contains("drive.csv: vehicle file drive.toml\n"), "{err}");
    let err = gyronet_in(&folder, &["replay", "plain.csv", "--csv", "plain_rates.csv", "--tum", "plain.tum"])
        .unwrap();
    assert!(!err.contains("vehicle file"), "{err}");
    let [turned, plain] = ["rates.csv", "plain_rates.csv"].map(|name| column(&folder.join(name), ',', 2));
    assert_eq!(turned.len(), 2_200);
    for (turned, plain) in turned.iter().zip(&plain) {
        // The turn by half a circle is rounded, and the network is not linear.
        assert!((turned - plain).abs() < 5e-5, "{turned} {plain}");
    }
    // Twice the radius is twice the way.
    let [turned, plain] = ["path.tum", "plain.tum"].map(|name| column(&folder.join(name), ' ', 1));
    let (turned, plain) = (turned.last().unwrap(), plain[turned.len() - 1]);
    assert!(plain > 10.0 && (turned / plain - 2.0).abs() < 1e-3, "{turned} {plain}");

    for command in ["evaluate", "calibrate", "doctor"] {
        let err = gyronet_in(&folder, &[command, "drive.csv"]).unwrap_or_else(|err| err);
        assert!(err.contains("drive.csv: vehicle file drive.toml\n"), "{command}: {err}");
    }
    std::fs::write(folder.join("drive.mcap"), b"\x89MCAP0\r\n").unwrap();
    for command in ["evaluate", "calibrate", "doctor", "replay"] {
        let err = gyronet_in(&folder, &[command, "drive.mcap"]).unwrap_err();
        let command = "gyronet import drive.mcap --out drive.csv\n";
        assert!(err.ends_with(command) && err.lines().count() == 1, "{err}");
    }
    let err = gyronet_in(&folder, &["demo", "drive.csv", "--out", "demo"]).unwrap();
    assert!(err.contains("drive.csv: vehicle file drive.toml\n"), "{err}");
    let page = std::fs::read_to_string(folder.join("demo/demo.html")).unwrap();
    assert!(page.contains("(radius 0.578 m)"), "the page says what the path rests on");
}

/// Checks for the Python that reads logs.
fn imports() -> bool {
    let program = "import asammdf, can, cantools, mcap, numpy, pyulog, rosbags";
    let found = std::env::var_os("GYRONET_PYTHON")
        .is_some_and(|python| Command::new(python).args(["-c", program]).status().is_ok_and(|s| s.success()));
    let required = std::env::var("GYRONET_REQUIRE").is_ok_and(|required| required.contains("python"));
    assert!(found || !required, "GYRONET_PYTHON has not the packages of tools/requirements.txt");
    if !found {
        // Not `eprintln!`: the test harness would keep it to itself.
        std::io::stderr().write_all(b"SKIPPED: GYRONET_PYTHON names no Python that reads logs\n").unwrap();
    }
    found
}

#[test]
fn what_import_writes_is_not_turned_again() {
    if !imports() {
        return;
    }
    let folder = folder("vehicle_import", "[mounting]\nroll_deg = 180\n");
    let import =
        |out: &str| gyronet_in(&folder, &["import", "drive.csv", "--vehicle", "drive.toml", "--out", out]);
    let err = import("drive.csv").unwrap_err();
    assert!(err.contains("drive.csv: --out would overwrite it"), "{err}");
    import("level.csv").unwrap();
    let up = column(&folder.join("level.csv"), ',', 3);
    assert!(up.len() == 2_500 && up.iter().all(|up| *up > 5.0));
    let header = std::fs::read_to_string(folder.join("level.csv")).unwrap();
    assert!(
        header.starts_with("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z,wheel1_rate,wheel2_rate"),
        "{header}"
    );
    let err = gyronet_in(&folder, &["replay", "level.csv", "--csv", "rates.csv"]).unwrap();
    assert!(err.contains("level.csv: vehicle file level.toml\n"), "{err}");

    // Neither turned nor stripped of wheels and reference by another import.
    gyronet_in(&folder, &["import", "level.csv", "--from", "1", "--out", "later.csv"]).unwrap();
    let [level, later] =
        ["level.csv", "later.csv"].map(|name| std::fs::read_to_string(folder.join(name)).unwrap());
    assert_eq!(level.lines().next(), later.lines().next());
    let values = |line: &str| line.split(',').skip(1).map(|text| text.parse().unwrap()).collect::<Vec<f64>>();
    for (level, later) in level.lines().skip(101).zip(later.lines().skip(1)) {
        let (level, later) = (values(level), values(later));
        assert!(level.iter().zip(&later).all(|(a, b)| (a - b).abs() < 1e-6), "{level:?} {later:?}");
    }

    let day = std::fs::read_to_string(folder.join("level.toml")).unwrap();
    std::fs::write(
        folder.join("level.toml"),
        day.replace("[recording]\n", "[recording]\nstart = 1700000000.25\n"),
    )
    .unwrap();
    let outputs = ["--csv", "day.csv", "--tum", "day.tum", "--out", "day.log"];
    gyronet_in(&folder, &[&["replay", "level.csv"][..], &outputs].concat()).unwrap();
    let times = |name: &str, separator: char| column(&folder.join(name), separator, 0);
    let (plain, day, path) = (times("rates.csv", ','), times("day.csv", ','), times("day.tum", ' '));
    assert_eq!(plain.len(), day.len());
    assert!(plain.iter().zip(&day).all(|(plain, day)| (day - plain - 1_700_000_000.25).abs() < 1e-3));
    assert!((path[0] - day[0]).abs() < 1e-3, "{path:?}");
    let log = std::fs::read_to_string(folder.join("day.log")).unwrap();
    assert!(log.starts_with("(170000000"), "{}", &log[..40]);
}
