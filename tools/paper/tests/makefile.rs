//! The Makefile with programs that only write their results: the paper's split, the order of the steps, what a second
//! run repeats, and what goes on when a step fails.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Output};
use tempfile::TempDir;

/// Writes its arguments to `ran`, and every file that the step makes; fails where a name is in `$FAILING`.
const PROGRAM: &str = r#"#!/bin/sh
echo "$*" >> "$RAN"
case "$*" in *$FAILING*) echo "out of memory" >&2; exit 1;; esac
out=$(echo "$*" | sed -n 's/.*--\(out\|csv\) \([^ ]*\).*/\2/p')
stem=$(echo "$*" | sed -n 's/.*--stem \([^ ]*\).*/\1/p')
module=$(echo "$*" | sed -n 's/^-m gyronet_train\.*\([a-z]*\).*/\1/p')
case "$*" in
    "-m gyronet_train "*) touch "$out/gyronet.safetensors";;
    *--stem*) touch "$out/$stem.safetensors";;
    -m*) mkdir -p "$out"; touch "$out/$module.json";;
    tables*) ;;
    *--out*|*--csv*) touch "$out";;
esac
"#;

struct Run {
    folder: TempDir,
}

impl Run {
    fn new(names: &[&str]) -> Self {
        let run = Self { folder: tempfile::tempdir().unwrap() };
        let program = run.path("program");
        fs::write(&program, PROGRAM).unwrap();
        Command::new("chmod").args(["+x", &program]).status().unwrap();
        for name in names {
            let file = PathBuf::from(run.path("data")).join(name).join("sensor_data/fog.csv");
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, "1").unwrap();
        }
        run
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn make(&self, failing: &str) -> Option<(Output, Vec<String>)> {
        let (ran, program) = (self.path("ran"), self.path("program"));
        fs::write(&ran, "").unwrap();
        let output = Command::new("make")
            .args(["-k", "-f", concat!(env!("CARGO_MANIFEST_DIR"), "/Makefile")])
            .args([
                "SET=kaist".into(),
                format!("DATA={}", self.path("data")),
                format!("OUT={}", self.path("out")),
            ])
            .args(["GYRONET", "PAPER", "PYTHON"].map(|name| format!("{name}={program}")))
            .env("RAN", &ran)
            .env("FAILING", if failing.is_empty() { "nothing at all" } else { failing })
            .output();
        let Ok(output) = output else {
            // Not `eprintln!`: the test harness would keep it to itself.
            std::io::stderr().write_all(b"SKIPPED the paper's Makefile: no make\n").unwrap();
            return None;
        };
        let ran =
            fs::read_to_string(&ran).unwrap().replace(&format!("{}/", self.folder.path().display()), "");
        Some((output, ran.lines().map(str::to_owned).collect()))
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const KAIST: [&str; 6] = ["urban06", "urban07-city", "urban14", "urban18", "urban28-pankyo", "urban38"];

#[test]
fn steps_run_once_and_again_for_what_has_changed() {
    let run = Run::new(&KAIST);
    let Some((output, ran)) = run.make("") else { return };
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("urban08 urban09"), "missing ones are named");
    let find = |start: &str| ran.iter().find(|line| line.starts_with(start)).expect(start).as_str();
    assert!(
        find("-m gyronet_train ").ends_with("--train urban06.csv urban07-city.csv --validate urban14.csv")
    );
    let tables = find("tables ");
    assert!(tables.starts_with("tables data/urban14 data/urban18 data/urban28-pankyo --train data/urban06 "));
    for part in ["--weights out/networks/gyronet.blob", "--method lwoi=out/lwoi/model", "--method rinsw="] {
        assert!(tables.contains(part), "{tables}");
    }
    let rates = ran.iter().filter(|line| line.starts_with("replay ")).count();
    assert_eq!((ran.len(), rates), (17, 3), "{ran:#?}");
    assert!(!ran.iter().any(|line| line.contains("urban38")), "not in the paper");

    let (_, again) = run.make("").unwrap();
    assert!(again.is_empty(), "{again:#?}");
    // A test sequence: nothing of ours is trained on it.
    let changed = run.path("data/urban18/sensor_data/fog.csv");
    let later = std::time::SystemTime::now() + std::time::Duration::from_secs(1);
    fs::File::options().append(true).open(changed).unwrap().set_modified(later).unwrap();
    let (_, again) = run.make("").unwrap();
    let starts: Vec<_> = again.iter().map(|line| line.split(" --").next().unwrap()).collect();
    assert!(again[0].starts_with("import data/urban18"), "{again:#?}");
    assert!(starts.contains(&"-m gyronet_train.lwoi") && !starts.contains(&"-m gyronet_train.fognet"));
}

#[test]
fn a_failed_step_is_named_and_the_others_go_on() {
    let run = Run::new(&KAIST);
    let Some((output, ran)) = run.make("--stem fognet") else { return };
    let error = text(&output.stderr);
    assert!(
        !output.status.success() && error.contains("out/networks/fognet.safetensors] Error 1"),
        "{error}"
    );
    for step in ["-m gyronet_train.lwoi", "-m gyronet_train.rinsw", "quantize out/networks/pseudo_fog"] {
        assert!(ran.iter().any(|line| line.starts_with(step)), "{step}: {ran:#?}");
    }
    assert!(!ran.iter().any(|line| line.starts_with("tables")), "{ran:#?}");
    let (output, ran) = run.make("").unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(ran.len(), 3, "FoGNet, its weights, the tables: {ran:#?}");
}

#[test]
fn a_set_needs_its_roles() {
    let Some((output, _)) = Run::new(&["urban06"]).make("") else { return };
    assert!(
        text(&output.stderr).contains("one of urban14 urban15 urban16 urban17"),
        "{}",
        text(&output.stderr)
    );
}
