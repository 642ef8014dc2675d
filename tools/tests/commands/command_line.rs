//! The command line as a whole: help, exit statuses and colours.

use super::{column, command, gyronet, gyronet_in, scratch, text};
use std::process::Stdio;

fn subcommands() -> Vec<String> {
    let help = text(&gyronet(&["--help"]).stdout);
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let (list, _) = list.split_once("\n\n").unwrap();
    list.lines().map(|line| line.split_whitespace().next().unwrap().to_owned()).collect()
}

#[test]
fn every_help_begins_with_one_line_and_ends_with_examples() {
    let names = subcommands();
    assert!(names.len() >= 13, "{names:?}");
    for name in names.iter().filter(|name| *name != "help") {
        let output = gyronet(&["help", name]);
        let help = text(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{name}");
        let first = help.lines().next().unwrap();
        assert!(first.len() <= 80 && help.contains(&format!("Usage: gyronet {name}")), "{name}: {first}");
        let without_files = ["bench-target", "size"];
        assert!(help.contains("Examples:") || without_files.contains(&name.as_str()), "{name}");
    }
    assert!(text(&gyronet(&["--help"]).stdout).contains("Exit status: 0 success; 1 failure"));
}

#[test]
fn shells_complete_every_subcommand() {
    for shell in ["bash", "zsh", "fish"] {
        let script = text(&gyronet(&["completions", shell]).stdout);
        assert!(subcommands().iter().all(|name| script.contains(name)), "{shell}");
    }
}

#[test]
fn a_reader_that_has_gone_is_no_failure() {
    let mut child =
        command(&["reference", "states"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
}

#[test]
fn a_bench_that_cannot_run_says_what_to_fetch() {
    let output = gyronet(&["bench-target", "--cmsis-nn", "/nowhere"]);
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(err.contains("git clone --depth 1 https://") && err.trim_end().lines().count() == 1, "{err}");
}

#[test]
fn wrong_arguments_are_status_2_and_failures_1() {
    for wrong in [
        &["nonsense"][..],
        &["evaluate"],
        &["replay", "a.csv", "--via", "icm42688"],
        &["simulate", "--out", "a.csv", "--seconds", "1"],
        &["device", "info"],
    ] {
        let output = gyronet(wrong);
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {}", text(&output.stderr));
        assert!(output.stdout.is_empty() && text(&output.stderr).contains("error"), "{wrong:?}");
    }
    for missing in [
        &["demo", "/nowhere/drive.csv"][..],
        &["evaluate", "/nowhere/drive.csv"],
        &["replay", "/nowhere/drive.csv"],
        &["simulate", "--out", "/nowhere/drive.csv"],
        &["import", "kaist", "/nowhere"],
        &["quantize", "/nowhere/a.safetensors", "--out", "/nowhere/a.blob"],
        &["size", "--elf", "/nowhere/image"],
        &["device", "--port", "/nowhere/tty", "info"],
    ] {
        let output = gyronet(missing);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{missing:?}: {error}");
        assert!(error.starts_with("error: ") && error.contains("/nowhere"), "{missing:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{missing:?}: {error}");
    }
}

#[test]
fn json_is_json_and_quiet_is_quiet() {
    let drive = format!("{}/quiet.csv", env!("CARGO_TARGET_TMPDIR"));
    let log = format!("{}/quiet.log", env!("CARGO_TARGET_TMPDIR"));
    for (arguments, field) in [
        (&["simulate", "--seconds", "12", "--out", &drive][..], "samples"),
        (&["evaluate", &drive], "drives"),
        (&["replay", &drive, "--out", &log], "frames"),
    ] {
        let output = gyronet(&[arguments, &["--json"]].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(!json[field].is_null(), "{arguments:?}: {json}");
        let output = gyronet(&[arguments, &["--quiet"]].concat());
        assert!(output.status.success() && output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn an_outage_without_a_start_is_a_failure_that_names_the_columns() {
    let drive = format!("{}/no_course.csv", env!("CARGO_TARGET_TMPDIR"));
    assert!(gyronet(&["simulate", "--seconds", "12", "--out", &drive]).status.success());
    let output = gyronet(&["evaluate", &drive, "--outage", "5", "--quiet"]);
    let error = text(&output.stderr);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{error}");
    assert!(error.contains("gnss_lat and gnss_lon") && error.contains("then 5 s"), "{error}");
}

#[test]
fn an_outage_without_gain_or_level_changes_the_rows_that_learn_them_alone() {
    let drive = format!("{}/with_course.csv", env!("CARGO_TARGET_TMPDIR"));
    let simulate = ["simulate", "--seconds", "150", "--gnss", "0.5", "--tilt", "4,3", "--out", &drive];
    assert!(gyronet(&simulate).status.success());
    let medians = |arguments: &[&str]| {
        let output = gyronet(&[&["evaluate", &drive, "--outage", "10", "--json"], arguments].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        ["static_zero_rate", "ekf", "no_model", "default"]
            .map(|row| json["outage"]["10"][row]["heading_deg"]["median"].as_f64().unwrap().to_bits())
    };
    let [zero_rate, ekf, ours @ ..] = medians(&[]);
    for parts in ["gain", "level", "gain,level"] {
        let without = medians(&["--without", parts]);
        assert_eq!([zero_rate, ekf], without[..2], "{parts}");
        assert!(ours.iter().zip(&without[2..]).all(|(learnt, not)| learnt != not), "{parts}: {without:?}");
    }
}

#[test]
fn colours_are_for_terminals() {
    let colored = |variable: &str| {
        let mut command = command(&["size", "--elf", "/nowhere/image"]);
        let output = command.env_remove("NO_COLOR").env(variable, "1").output().unwrap();
        output.stderr.contains(&0x1b)
    };
    assert!(colored("CLICOLOR_FORCE"));
    assert!(!colored("NO_COLOR") && !colored("ANYTHING"));
}

#[test]
fn retired_names_say_what_does_their_work() {
    for (retired, successor) in [
        (&["campaign", "--upsets"][..], "--bin situations"),
        (&["paper", "KAIST", "--out", "OUT"], "make -f tools/paper/Makefile"),
        (&["train", "DRIVES"], "python -m gyronet_train.linear"),
        (&["device", "calibrate", "mounting", "--store"], "the board itself"),
        (&["device", "log"], "`device info`"),
        (&["bench-target", "--policies"], "cargo bringup"),
        (&["demo", "--image"], "--test board"),
        (&["monitor", "can.log"], "cantools decode"),
        (&["doctor", "drive.csv", "--weights", "mine.blob"], "gyronet evaluate --weights"),
        (&["simulate", "--layout", "kaist", "--out", "OUT"], "cargo paper simulate"),
        (&["import", "urban06", "--training", "--out", "a.csv"], "cargo paper import"),
        (&["doctor", "drive.csv", "--out", "page.html"], "gyronet doctor --json"),
        (&["replay", "drive.csv", "--mcap", "drive.mcap"], "gyronet correct"),
        (&["evaluate", "drive.csv", "--lags"], "`compensate.lag`"),
        (&["import", "kaist", "urban06"], "cargo paper import urban06"),
        (&["import", "nclt", "2012-01-08"], "reads KAIST Complex Urban"),
    ] {
        let output = gyronet(retired);
        let error = text(&output.stderr);
        assert!(!output.status.success() && error.contains(successor), "{retired:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{retired:?}: {error}");
    }
}

#[test]
fn a_drive_that_begins_in_motion_is_replayed_by_its_courses() {
    let folder = scratch("replay-courses");
    let simulate = ["-q", "simulate", "--seconds", "150", "--gnss", "0.5", "--out", "whole.csv"];
    gyronet_in(&folder, &simulate).unwrap();
    let whole = std::fs::read_to_string(folder.join("whole.csv")).unwrap();
    let (header, rows) = whole.split_once('\n').unwrap();
    // It stands at 65 s and at 125 s.
    let rows: String = rows.lines().skip(7_200).map(|row| format!("{row}\n")).collect();
    std::fs::write(folder.join("moving.csv"), format!("{header}\n{rows}")).unwrap();
    let said = gyronet_in(&folder, &["replay", "moving.csv", "--csv", "rates.csv"]).unwrap();
    let started = column(&folder.join("rates.csv"), ',', 0)[0];
    assert!(said.contains("courses used 6") && started < 100.0, "from {started} s on: {said}");
    let blind = header.replace("course,course_sigma,gnss_speed", "a,b,c");
    std::fs::write(folder.join("blind.csv"), format!("{blind}\n{rows}")).unwrap();
    let said = gyronet_in(&folder, &["replay", "blind.csv", "--csv", "none.csv"]).unwrap_err();
    assert!(said.contains("starts moving") && !folder.join("none.csv").exists(), "{said}");
}
