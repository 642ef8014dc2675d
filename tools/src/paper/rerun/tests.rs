//! Tests split, plan and resumption with a runner that writes empty files: no PyTorch is needed.

use super::plan::{Effort, Program, Step, plan};
use super::report::{Report, Set};
use super::run::{Outcome, Outcomes, Runner, log, run};
use super::split::{Role, Split};
use crate::paper::sequence::{self, Sequence};
use crate::simulate::layout::{self, Layout, Spec};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::{TempDir, tempdir};

/// Creates folders that look like sequences of KAIST Urban.
fn tree(folder: &TempDir, names: &[&str]) -> PathBuf {
    let root = folder.path().join("kaist");
    for name in names {
        fs::create_dir_all(root.join(name).join("sensor_data")).unwrap();
        fs::write(root.join(name).join("global_pose.csv"), "1").unwrap();
    }
    root
}

/// A runner that writes the output of each step, except of those that are to fail, and records the commands.
struct Fake {
    outputs: BTreeMap<PathBuf, Option<PathBuf>>,
    failing: &'static str,
    ran: Vec<Vec<String>>,
}

impl Runner for Fake {
    fn program(&self, program: Program) -> String {
        format!("{program:?}")
    }

    fn files(&self, _: Program) -> Vec<PathBuf> {
        Vec::new()
    }

    fn run(&mut self, _: Program, command: &[String], log: &Path) -> Result<(), String> {
        self.ran.push(command.to_vec());
        if !self.failing.is_empty() && log.ends_with(self.failing) {
            return Err("out of memory".into());
        }
        if let Some(output) = &self.outputs[log] {
            fs::write(output, "made").unwrap();
        }
        fs::write(log, "printed\n").unwrap();
        Ok(())
    }
}

fn go(steps: &[Step], out: &Path, failing: &'static str) -> (Outcomes, Vec<Vec<String>>) {
    let outputs = steps.iter().map(|step| (log(out, &step.name), step.output.clone())).collect();
    let mut fake = Fake { outputs, failing, ran: Vec::new() };
    let outcomes = run(steps, out, &mut fake, |_, _| {}).unwrap();
    (outcomes, fake.ran)
}

/// Returns the names of the steps that were run now.
fn made(outcomes: &Outcomes) -> Vec<&str> {
    let now = outcomes.iter().filter(|(_, outcome)| matches!(outcome, Outcome::Made(_)));
    now.map(|(name, _)| name.as_str()).collect()
}

const NAMES: [&str; 4] = ["urban06", "urban07-city", "urban14", "urban18"];

#[test]
fn sequences_are_split_as_in_the_paper_and_missing_ones_named() {
    let scratch = tempdir().unwrap();
    let root =
        tree(&scratch, &["urban06", "urban06-again", "urban13", "urban17", "urban28-pankyo", "urban38"]);
    fs::create_dir_all(root.join("urban20")).unwrap();
    let split = Split::find(Layout::Kaist, &root).unwrap();
    let members: Vec<_> = split.members.iter().map(|member| (member.name.as_str(), member.role)).collect();
    let expected = [
        ("urban06", Role::Train),
        ("urban13", Role::Train),
        ("urban17", Role::Validate),
        ("urban28-pankyo", Role::Test),
    ];
    assert_eq!(members, expected);
    assert_eq!(split.missing.len(), 28);
    assert_eq!(split.missing[..2], ["urban07", "urban08"]);
    assert!(split.missing.contains(&"urban20".to_owned()));
    let unused = split.unused.join("\n");
    for why in ["urban06-again: a second urban06", "urban20: neither a KAIST", "urban38: not in the paper"] {
        assert!(unused.contains(why), "{unused}");
    }
}

#[test]
fn dates_of_nclt_are_split_as_in_the_paper() {
    let scratch = tempdir().unwrap();
    for date in ["2012-01-08", "2012-08-20", "2013-04-05"] {
        fs::create_dir_all(scratch.path().join(date)).unwrap();
        fs::write(scratch.path().join(date).join("kvh.csv"), "").unwrap();
    }
    let split = Split::find(Layout::Nclt, scratch.path()).unwrap();
    let roles: Vec<_> = split.members.iter().map(|member| member.role).collect();
    assert_eq!((roles, split.missing.len()), (vec![Role::Train, Role::Validate, Role::Test], 24));
    let steps = plan(&split, Effort::FULL, scratch.path(), |_| Vec::new());
    assert!(steps.iter().all(|step| !step.name.contains("lwoi") && !step.name.contains("rinsw")));
}

#[test]
fn a_tree_without_a_validation_sequence_is_refused_with_their_names() {
    let scratch = tempdir().unwrap();
    let error = Split::find(Layout::Kaist, &tree(&scratch, &["urban06", "urban18"])).unwrap_err().to_string();
    assert!(
        error.ends_with("no sequence to validate with; needed is one of urban14, urban15, urban16, urban17"),
        "{error}"
    );
    let error = Split::find(Layout::Kaist, Path::new("/nowhere")).unwrap_err().to_string();
    assert!(error.starts_with("/nowhere: "), "{error}");
}

#[test]
fn a_second_run_repeats_what_has_changed_and_nothing_else() {
    let scratch = tempdir().unwrap();
    let (root, out) = (tree(&scratch, &NAMES), scratch.path().join("out"));
    let split = Split::find(Layout::Kaist, &root).unwrap();
    let steps = plan(&split, Effort::FULL, &out, sequence::files);
    let (first, ran) = go(&steps, &out, "");
    assert_eq!((made(&first).len(), ran.len()), (steps.len(), steps.len()));
    let (second, ran) = go(&steps, &out, "");
    assert!(ran.is_empty() && made(&second).is_empty(), "{second:?}");

    // A test sequence: nothing is trained on it.
    fs::write(root.join("urban18/global_pose.csv"), "1\n2").unwrap();
    let (third, _) = go(&steps, &out, "");
    assert_eq!(made(&third), ["kaist/urban18", "kaist/lwoi", "kaist/rinsw", "kaist/tables"]);
    // An option of one step.
    let other = Effort { fognet_epochs: 15, ..Effort::FULL };
    let (fourth, _) = go(&plan(&split, other, &out, sequence::files), &out, "");
    let fognets = [
        "kaist/fognet",
        "kaist/fognet-weights",
        "kaist/pseudo_fog",
        "kaist/pseudo_fog-weights",
        "kaist/tables",
    ];
    assert_eq!(made(&fourth), fognets);
    let (fifth, _) = go(&steps, &out, "");
    assert_eq!(made(&fifth), made(&fourth));
    // A result is deleted.
    fs::remove_file(out.join("kaist/lwoi/lwoi.json")).unwrap();
    let (sixth, _) = go(&steps, &out, "");
    assert_eq!(made(&sixth), ["kaist/lwoi"]);
}

#[test]
fn a_step_that_fails_is_named_and_tried_again_and_the_tables_go_on_without_it() {
    let scratch = tempdir().unwrap();
    let (root, out) = (tree(&scratch, &NAMES), scratch.path().join("out"));
    let split = Split::find(Layout::Kaist, &root).unwrap();
    let steps = plan(&split, Effort::FULL, &out, sequence::files);
    let (outcomes, ran) = go(&steps, &out, "kaist-fognet.log");
    let tables = ran.last().unwrap();
    assert!(tables.contains(&"--weights".to_owned()) && !tables.contains(&"--fog-weights".to_owned()));
    let report = Report { effort: Effort::FULL, sets: vec![Set { split, steps: outcomes }] };
    let remarks = report.remarks().join("\n");
    for line in [
        "KAIST Urban: missing 28: urban08,",
        "kaist/fognet: left out: out of memory",
        "kaist/fognet-weights: left out: it needs kaist/fognet",
    ] {
        assert!(remarks.contains(line), "{remarks}");
    }
    assert!(!report.is_whole());
    let markdown = report.markdown(&out).unwrap();
    assert!(
        markdown.contains(&remarks.lines().next().unwrap()[..40]) && markdown.contains("printed"),
        "{markdown}"
    );
    let (again, _) = go(&steps, &out, "");
    assert_eq!(made(&again), ["kaist/fognet", "kaist/fognet-weights", "kaist/tables"]);
}

#[test]
fn an_unreadable_sequence_is_trained_on_by_nobody() {
    let scratch = tempdir().unwrap();
    let (root, out) = (tree(&scratch, &NAMES), scratch.path().join("out"));
    let split = Split::find(Layout::Kaist, &root).unwrap();
    let steps = plan(&split, Effort::FULL, &out, sequence::files);
    let (outcomes, ran) = go(&steps, &out, "kaist-urban07-city.log");
    assert!(outcomes.contains(&("kaist/urban07-city".into(), Outcome::Failed("out of memory".into()))));
    let others: Vec<_> = ran.iter().filter(|command| command[1] != "import").collect();
    assert_eq!(others.len(), 11);
    assert!(others.iter().all(|command| !command.iter().any(|text| text.contains("urban07"))), "{others:?}");
}

#[test]
fn a_training_drive_has_no_step_in_a_gap_and_no_start_on_the_move() {
    let scratch = tempdir().unwrap();
    let folder = scratch.path().join("urban06");
    let spec = Spec { layout: Layout::Kaist, name: "urban06".into(), seconds: 60, device: 1, run: 1 };
    layout::write(&spec, &folder, || {}).unwrap();
    let steps = Sequence::read(&folder, |_| {}).unwrap().steps.len();
    let path = folder.join("sensor_data/encoder.csv");
    let rows: Vec<String> = fs::read_to_string(&path).unwrap().lines().map(str::to_owned).collect();
    let (stamp, _) = rows[1000].split_once(',').unwrap();
    let odd = format!("{stamp},nan,nan");
    // Half a second without wheels, a row that is not a number, and a repeated row.
    let cut = [&rows[..1000], &[odd], &rows[1001..2000], &rows[1999..2000], &rows[2050..]].concat();
    fs::write(&path, cut.join("\n")).unwrap();
    let sequence = Sequence::read(&folder, |_| {}).unwrap();
    sequence.needs_standstill().unwrap();
    assert_eq!(
        (sequence.steps.len(), sequence.files[2].duplicates.count, sequence.files[2].not_finite.count),
        (steps, 1, 1)
    );
    let whole = sequence::write_whole(&sequence, std::io::sink()).unwrap() as usize;
    assert!((steps - 53..=steps - 48).contains(&whole), "{whole} of {steps}");
    assert_eq!(sequence::write_csv(&sequence, std::io::sink()).unwrap() as usize, steps);
    let count = |row: &str| row.split(',').nth(1).unwrap().parse::<f64>().unwrap();
    // The file now begins where the wheel has turned ten times: the vehicle is driving.
    let driving = rows.iter().position(|row| (count(row) - count(&rows[0])).abs() > 40_960.0).unwrap();
    fs::write(&path, rows[driving..].join("\n")).unwrap();
    let error = Sequence::read(&folder, |_| {}).unwrap().needs_standstill().unwrap_err().to_string();
    assert!(error.contains("urban06: starts moving: its wheels roll"), "{error}");
}
