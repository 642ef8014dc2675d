//! `gyronet evaluate` and `gyronet replay` need no more memory for a long drive than for a short one.

use std::fmt::Write as _;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use std::process::Command;

/// Address space that a command gets, KiB: its own code, the stacks of two threads, and some MiB.
const KIB: u32 = 98_304;
/// An hour at 100 Hz: 41 MB of text. When the rows and steps of a drive were kept, this took 780 MB.
const ROWS: u32 = 360_000;

/// Writes a drive that stands for 5 s and then turns to both sides.
fn write_drive(path: &Path) {
    let mut file = BufWriter::new(std::fs::File::create(path).unwrap());
    writeln!(file, "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z,wheel2_rate,wheel4_rate").unwrap();
    let mut line = String::new();
    for k in 0..ROWS {
        line.clear();
        let noise = 1e-3 * (f64::from(k % 3) - 1.0);
        let (rate, wheels) =
            if k < 500 { (0.0, 0.0) } else { (0.2 * (0.002 * f64::from(k - 500)).sin(), 30.0) };
        write!(line, "{:.2},{noise},{noise},{:.3},", 0.01 * f64::from(k), 9.8 + 10.0 * noise).unwrap();
        writeln!(line, "{noise},{noise},{:.4},{rate:.4},{wheels},{wheels}", rate + noise).unwrap();
        file.write_all(line.as_bytes()).unwrap();
    }
    file.flush().unwrap();
}

#[test]
fn a_drive_larger_than_the_memory_is_evaluated_and_replayed() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let [drive, log] = ["drive.csv", "can.log"].map(|name| folder.path().join(name));
    write_drive(&drive);
    for (name, field) in [("evaluate", "drives"), ("replay", "frames")] {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("ulimit -v {KIB} && exec \"$@\""), "sh", env!("CARGO_BIN_EXE_gyronet")]);
        command.args([name, "--quiet", "--json"]).arg(&drive);
        if name == "replay" {
            command.arg("--out").arg(&log);
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(!json[field].is_null(), "{name}: {json}");
    }
    assert!(std::fs::metadata(&log).unwrap().len() > u64::from(KIB) * 512);
}
