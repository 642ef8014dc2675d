//! The command `gyronet-paper` as a process.

use std::process::{Command, Output};

fn paper(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gyronet-paper")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn wrong_arguments_are_status_2_and_failures_1() {
    for wrong in [
        &["nonsense"][..],
        &["tables", "urban14", "--method", "mine"],
        &["tables", "urban14", "--method", "mine="],
        &["tables", "urban14", "--method", "=mine"],
        &["simulate", "--layout", "nclt"],
    ] {
        let output = paper(wrong);
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {}", text(&output.stderr));
    }
    for missing in [
        &["simulate", "--minutes", "1", "--out", "/dev/null/one"][..],
        &["import", "/nowhere"],
        &["tables", "/nowhere"],
        &["tables", "urban14", "--method", "mine=/nowhere"],
        &["tables", "urban14", "--fog-weights", "/nowhere"],
        &["quantize", "/nowhere/a.safetensors", "--out", "/nowhere/a.blob"],
    ] {
        let output = paper(missing);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{missing:?}: {error}");
        assert!(error.starts_with("error: ") && error.contains("/"), "{missing:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{missing:?}: {error}");
    }
}

#[test]
fn tables_fit_to_training_sequences_and_take_other_methods() {
    let folder = tempfile::tempdir().unwrap();
    let [sequence, methods] = ["one", "methods"].map(|name| folder.path().join(name).display().to_string());
    std::fs::create_dir_all(&methods).unwrap();
    let made = paper(&["simulate", "--minutes", "1", "--out", &sequence]);
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let mine = format!("mine={methods}");
    let output = paper(&["tables", &sequence, "--train", &sequence, "--method", &mine]);
    let (tables, errors) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert!(tables.contains("FoG and wheels are fitted on one: "), "{tables}");
    assert!(tables.contains("mine: 1 of 1 sequences left out\n    "), "{tables}");
    assert!(tables.contains("one.txt: No such file"), "{tables}");
    let twice = paper(&["tables", &sequence, "--method", &mine, "--method", &mine]);
    assert_eq!(twice.status.code(), Some(1));
    assert!(text(&twice.stderr).contains("given twice"), "{}", text(&twice.stderr));
}

#[test]
fn an_imported_sequence_comes_with_its_radius() {
    let folder = tempfile::tempdir().unwrap();
    let [sequence, drive] = ["one", "car.csv"].map(|name| folder.path().join(name).display().to_string());
    for arguments in
        [&["simulate", "--minutes", "1", "--out", &sequence][..], &["import", &sequence, "--out", &drive]]
    {
        let output = paper(arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    let vehicle = std::fs::read_to_string(folder.path().join("car.toml")).unwrap();
    assert!(vehicle.contains("radius_m = 0.311"), "its wheels are larger than the recorded car's: {vehicle}");
}
