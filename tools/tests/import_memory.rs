//! `gyronet import` needs no more memory for a long log than for a short one.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::io::{BufWriter, Write as _};
use std::process::Command;

/// Address space that the command gets, KiB: its own code and stacks, and some MiB.
const KIB: u32 = 65_536;
/// Two hours at 100 Hz: 37 MB of text, 58 MB of numbers.
const ROWS: u32 = 720_000;

#[test]
fn a_log_larger_than_the_memory_is_imported() {
    // 100 MB, so not in memory.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let log = folder.path().join("log.csv");
    let mut file = BufWriter::new(std::fs::File::create(&log).unwrap());
    writeln!(file, "zeit;acc_x;acc_y;acc_z;gyr_x;gyr_y;gyr_z;wheel2_rate").unwrap();
    let mut line = String::new();
    for k in 0..ROWS {
        line.clear();
        let small = k % 7;
        writeln!(
            line,
            "{k}0;0.00{small}250;0.01{small}250;9.80{small}250;0.0001{small};0.0002{small};0.0003{small};0"
        )
        .unwrap();
        file.write_all(line.as_bytes()).unwrap();
    }
    file.into_inner().unwrap();
    std::fs::write(folder.path().join("log.toml"), "[columns]\nt_s = { name = 'zeit', unit = 'ms' }\n")
        .unwrap();

    let out = folder.path().join("drive.csv");
    let output = Command::new("sh")
        .args([
            "-c",
            &format!("ulimit -v {KIB} && exec \"$@\""),
            "sh",
            env!("CARGO_BIN_EXE_gyronet"),
            "import",
        ])
        .arg(&log)
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.starts_with(&format!("7199.99 s, {ROWS} rows, 0 records dropped")), "{said}");
    assert!(!said.contains("refuse"), "{said}");
    assert!(std::fs::metadata(&out).unwrap().len() > u64::from(KIB) * 512);
}
