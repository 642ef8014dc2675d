//! The command `gyronet train`: what it refuses, before it looks for Python.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Writes a drive that turns at a rate from the fourth second on.
fn write(folder: &Path, name: &str, seconds: u32, turn: f64) {
    let mut csv = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z\n");
    for k in 0..100 * seconds {
        let (noise, rate) = (1e-3 * f64::from(k % 3) - 1e-3, if k < 300 { 0.0 } else { turn });
        // Every axis flickers as a sensor does; equal readings are stuck ones.
        let (time, up, gyro) = (0.01 * f64::from(k), 9.8 + 10.0 * noise, rate + noise);
        writeln!(csv, "{time:.2},{noise},{noise},{up},{noise},{noise},{gyro},{rate}").unwrap();
    }
    std::fs::write(folder.join(name), csv).unwrap();
}

/// The one error of a training that does not begin.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gyronet"));
    command.arg("train").arg(folder).args(["--quiet", "--out"]).arg(folder.join("out")).args(arguments);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn a_folder_that_cannot_carry_a_training_is_refused_with_the_reasons() {
    let few = folder("train-few");
    assert!(refused(&few.join("none"), &[]).contains("train-few/none: No such file"));
    assert!(refused(&few, &[]).contains("0 drives can be used, but 4 are needed"));
    for name in ["a.csv", "b.csv", "c.csv"] {
        write(&few, name, 40, 0.1);
    }
    write(&few, "short.csv", 20, 0.1);
    std::fs::write(few.join("empty.csv"), "t_s\n").unwrap();
    let error = refused(&few, &[]);
    assert!(error.contains("3 drives can be used, but 4 are needed"), "{error}");
    assert!(error.contains("short.csv: 17 s after the 3 s at rest; training needs 30"), "{error}");
    assert!(error.contains("empty.csv: ") && error.lines().count() == 3, "{error}");

    write(&few, "d.csv", 40, 0.1);
    assert!(refused(&few, &[]).contains("the training drives have 74 s together, but 300 s are needed"));
    assert!(refused(&few, &["--validate", "z"]).contains("0 drives match the name \"z\""));
    assert!(refused(&few, &["--hold-out", "c", "d"]).contains("4 drives can be used, but 5 are needed"));

    let straight = folder("train-straight");
    for name in ["a.csv", "b.csv", "c.csv", "d.csv"] {
        write(&straight, name, 160, 0.001);
    }
    assert!(refused(&straight, &[]).contains("too few turns: the training drives turn by 0 degrees"));
}

#[test]
fn a_python_without_the_packages_is_named() {
    let folder = folder("train-python");
    for name in ["a.csv", "b.csv", "c.csv", "d.csv"] {
        write(&folder, name, 160, 0.1);
    }
    let error = refused(&folder, &["--python", "/nowhere/python"]);
    assert!(error.contains("/nowhere/python: No such file"), "{error}");
    // An interpreter that fails as one without the packages does.
    let error = refused(&folder, &["--python", "/bin/false"]);
    assert!(error.contains("/bin/false: ") && error.contains("needed: torch, numpy"), "{error}");
}
