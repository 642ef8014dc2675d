//! The Makefile by what make would run: the paper's split, the order of the steps, and what is made again after a change.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

/// Runs make in a folder that has the sequences in `data`; `None` without make.
fn make(folder: &Path, arguments: &[&str]) -> Option<(Output, String)> {
    let run = Command::new("make")
        .current_dir(folder)
        .args(["-f", concat!(env!("CARGO_MANIFEST_DIR"), "/Makefile"), "SET=kaist", "DATA=data", "OUT=out"])
        .args(["GYRONET=gyronet", "PAPER=paper", "PYTHON=python"])
        .args(arguments)
        .output();
    let Ok(output) = run else {
        // Not `eprintln!`: the test harness would keep it to itself.
        std::io::stderr().write_all(b"SKIPPED the paper's Makefile: no make\n").unwrap();
        return None;
    };
    let commands = String::from_utf8_lossy(&output.stdout).replace(" \\\n\t", " ");
    Some((output, commands))
}

fn with_sequences(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in names {
        let data = folder.path().join("data").join(name).join("sensor_data");
        fs::create_dir_all(&data).unwrap();
        fs::write(data.join("fog.csv"), "1").unwrap();
    }
    folder
}

#[test]
fn steps_run_once_and_again_for_what_has_changed() {
    let names = ["urban06", "urban07-city", "urban14", "urban18", "urban28-pankyo", "urban38"];
    let folder = with_sequences(&names);
    let Some((output, commands)) = make(folder.path(), &["-n"]) else { return };
    assert!(output.status.success(), "{output:?}");
    let (missing, steps) = commands.split_once('\n').unwrap();
    assert!(missing.contains("urban08 urban09"), "missing ones are named");
    assert!(!steps.contains("urban38"), "not in the paper");
    assert_eq!(steps.lines().count(), 17, "{steps}");
    for part in [
        "import data/urban06 --training --out out/drives/urban06.csv",
        "--train urban06.csv urban07-city.csv --validate urban14.csv",
        "--out out/networks --stem fognet ",
        "replay out/drives/urban14.csv --weights out/networks/gyronet.blob --csv out/rates/urban14.csv",
        "quantize out/networks/pseudo_fog.safetensors --out out/networks/pseudo_fog.blob",
        "tables data/urban14 data/urban18 data/urban28-pankyo --train data/urban06 ",
        "--weights out/networks/gyronet.blob",
        "--method lwoi=out/lwoi/model --method rinsw=",
    ] {
        assert!(steps.contains(part), "{part}: {steps}");
    }
    make(folder.path(), &["--touch"]).unwrap();
    let (_, again) = make(folder.path(), &["-n"]).unwrap();
    assert!(again.contains("Nothing to be done"), "{again}");
    // A test sequence: nothing of ours is trained on it.
    let changed = "data/urban18/sensor_data/fog.csv";
    let (_, again) = make(folder.path(), &["-n", "--what-if", changed]).unwrap();
    let starts: Vec<_> = again.lines().skip(1).map(|line| line.split(" --").next().unwrap()).collect();
    let [import, rivals @ .., tables] = &starts[..] else { panic!("{again}") };
    assert_eq!(rivals, ["python -m gyronet_train.lwoi", "python -m gyronet_train.rinsw"]);
    assert!(import.starts_with("paper import data/urban18") && tables.starts_with("paper tables"), "{again}");
}

#[test]
fn a_set_needs_its_roles() {
    let Some((output, _)) = make(with_sequences(&["urban06"]).path(), &[]) else { return };
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("one of urban14 urban15 urban16 urban17"), "{error}");
}
