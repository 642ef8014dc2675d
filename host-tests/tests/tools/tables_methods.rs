//! `gyronet-paper tables --method`: another program's trajectories in the tables, on simulated sequences. The truth has no
//! error, a known error is found, and what cannot be compared is named and never a number.

use gyronet_host_tests::sequence::simulate;
use gyronet_paper::sequence::Sequence;
use gyronet_paper::simulate::Spec;
use gyronet_paper::tables::estimates::Estimates;
use gyronet_paper::tables::given::Given;
use gyronet_paper::tables::results::{Errors, Results, SequenceErrors};
use gyronet_paper::tables::table;
use gyronet_tools::evaluate::trajectory_error::Point;
use std::fmt::Write;
use std::fs;
use tempfile::{TempDir, tempdir};

/// The methods are compared from here on.
const START: usize = 300;
const NAME: &str = "other program";

/// The folder of the other program's trajectories.
struct Scratch(TempDir);

impl Scratch {
    fn new() -> Self {
        Self(tempdir().unwrap())
    }

    fn given(&self) -> Given {
        format!("{NAME}={}", self.0.path().display()).parse().unwrap()
    }

    fn write(&self, sequence: &Sequence, rows: &[String]) {
        fs::write(self.0.path().join(format!("{}.txt", sequence.name)), rows.join("\n")).unwrap();
    }

    fn errors(&self, sequence: &Sequence) -> SequenceErrors {
        let mut estimates = Estimates { start: START, ..Estimates::default() };
        estimates.add_given(sequence, &self.given());
        SequenceErrors::new(sequence, &estimates)
    }

    fn compared(&self, sequence: &Sequence) -> Errors {
        let errors = self.errors(sequence);
        assert!(errors.left_out.is_empty(), "{:?}", errors.left_out);
        errors.methods[NAME]
    }
}

fn sequence(name: &str) -> Sequence {
    simulate(&Spec { name: name.into(), seconds: 120, device: 1, run: 5 })
}

/// A row of the format for each step; places are from the sequence's first.
fn rows(sequence: &Sequence, pose: impl Fn(usize) -> (Point, f64)) -> Vec<String> {
    let row = |k: usize| {
        let ([x, y], yaw) = pose(k);
        let (time, [east, north]) = (sequence.start_s + k as f64 * 0.01, sequence.origin);
        let (z, w) = (yaw / 2.0).sin_cos();
        let mut row = String::new();
        write!(row, "{time:.6} {:.6} {:.6} 61.5 0 0 {z:.9} {w:.9}", east + x, north + y).unwrap();
        row
    };
    (0..sequence.steps.len()).map(row).collect()
}

fn truth(sequence: &Sequence) -> Vec<String> {
    rows(sequence, |k| (sequence.steps[k].position, sequence.steps[k].yaw))
}

#[test]
fn the_truth_has_no_error() {
    let (scratch, sequence) = (Scratch::new(), sequence("k"));
    // As lwoi writes: whole seconds, so a little less than the sequence.
    let mut rows = truth(&sequence);
    rows.truncate(rows.len() - 95);
    scratch.write(&sequence, &rows);
    let errors = scratch.compared(&sequence);
    assert!(errors.ate_m < 1e-4 && errors.aligned_ate_m < 1e-4, "{errors:?}");
    assert!(errors.mean_1s_rad < 1e-7 && errors.final_unwrapped_rad < 1e-6, "{errors:?}");
    // Ten poses a second are enough.
    let slow: Vec<String> = truth(&sequence).into_iter().step_by(10).collect();
    scratch.write(&sequence, &slow);
    let errors = scratch.compared(&sequence);
    assert!(errors.ate_m < 0.005, "{errors:?}");
}

#[test]
fn a_known_error_is_found() {
    let (scratch, sequence) = (Scratch::new(), sequence("k"));
    let steps = &sequence.steps;
    let shifted = rows(&sequence, |k| {
        let ([x, y], turned) = (steps[k].position, if k > 5_000 { 0.02 } else { 0.0 });
        ([x + 0.3, y - 0.4], steps[k].yaw + turned)
    });
    scratch.write(&sequence, &shifted);
    let errors = scratch.compared(&sequence);
    assert!((errors.ate_m - 0.5).abs() < 1e-5 && (errors.ate_mean_m - 0.5).abs() < 1e-5, "{errors:?}");
    assert!(errors.aligned_ate_m < 1e-4, "{errors:?}");
    assert!((errors.final_rad - 0.02).abs() < 1e-6, "{errors:?}");
    // It turns wrongly in one second of all.
    let seconds = ((steps.len() - START) / 100) as f64;
    assert!((errors.mean_1s_rad - 0.02 / seconds).abs() < 1e-6, "{errors:?}");

    // A heading that is wrong from the start counts at the end, and is no frame of its own yet.
    scratch.write(&sequence, &rows(&sequence, |k| (steps[k].position, steps[k].yaw + 0.05)));
    let errors = scratch.compared(&sequence);
    assert!((errors.final_rad - 0.05).abs() < 1e-6 && errors.ate_m < 1e-4, "{errors:?}");
}

#[test]
fn what_cannot_be_compared_is_left_out_and_named() {
    let (scratch, sequence) = (Scratch::new(), sequence("k"));
    let good = truth(&sequence);
    let steps = &sequence.steps;
    let shifted = |seconds: f64| {
        let later = Sequence { start_s: sequence.start_s + seconds, ..sequence.clone() };
        truth(&later)
    };
    let mut holed = good.clone();
    holed.drain(700..760);
    let far = rows(&sequence, |k| {
        let [x, y] = steps[k].position;
        (if k < 9_000 { [x, y] } else { [x + 3e4, y] }, steps[k].yaw)
    });
    let turned = rows(&sequence, |k| (steps[k].position, steps[k].yaw + 0.5));
    let own_frame =
        rows(&Sequence { origin: [0.0; 2], ..sequence.clone() }, |k| (steps[k].position, steps[k].yaw));
    for (rows, expected) in [
        (good[..9_000].to_vec(), "k.txt: has poses from 1524000000.01 to 1524000090.00 s, but"),
        (good[1_000..].to_vec(), "k.txt: has poses from 1524000010.01 to"),
        (shifted(-86_400.0), "k.txt: has poses from 1523913600.01 to"),
        (shifted(-1.524e9), "k.txt: has poses from 0.01 to 119.99 s, but 1524000003.00 to"),
        (own_frame, "k.txt: line 299: 4040624.95 m and 0.0 deg from the truth at the start"),
        (turned, "k.txt: line 299: 0.00 m and 28.6 deg from the truth at the start"),
        (holed, "k.txt: line 701: 0.61 s after the previous pose"),
        (far, "k.txt: line 9001: 29999 m from the truth, where at most 1903 m are possible"),
        (Vec::new(), "k.txt: holds no samples"),
    ] {
        scratch.write(&sequence, &rows);
        let errors = scratch.errors(&sequence);
        let why = errors.left_out.get(NAME).unwrap_or_else(|| panic!("no fault, expected {expected}"));
        assert!(why.contains(expected), "{why}\nis not {expected}");
        assert!(errors.methods.is_empty() && errors.order.is_empty());
    }
    fs::remove_file(scratch.0.path().join("k.txt")).unwrap();
    let why = &scratch.errors(&sequence).left_out[NAME];
    assert!(why.contains("k.txt: No such file"), "{why}");
}

#[test]
fn the_tables_count_what_was_left_out() {
    let scratch = Scratch::new();
    let sequences = ["a", "b"].map(sequence);
    scratch.write(&sequences[0], &truth(&sequences[0]));
    let both = sequences.each_ref().map(|sequence| scratch.errors(sequence));
    let tables = table::tables(&Results::new(both.to_vec()));
    let titles: Vec<&str> = tables.iter().map(|table| table.title.split(':').next().unwrap()).collect();
    assert_eq!(titles, ["Table I", "Table II", "Table IV"]);
    for table in &tables[..3] {
        let note = table.notes.iter().position(|note| note == "other program: 1 of 2 sequences left out");
        let note = note.unwrap_or_else(|| panic!("{}: {:?}", table.title, table.notes));
        assert!(table.notes[note + 1].contains("b.txt: No such file"), "{:?}", table.notes);
        // No number for what was left out, nor for a mean over one of two.
        let last = table.rows.last().unwrap();
        assert!(last.figures.iter().all(Option::is_none), "{table}");
        assert!(table.to_string().contains(NAME), "{table}");
    }
    assert!(tables[1].rows[0].figures.iter().all(Option::is_some), "{}", tables[1]);
    assert!(tables[1].rows[1].figures.iter().all(Option::is_none), "{}", tables[1]);

    let alone = table::tables(&Results::new(both[..1].to_vec()));
    assert_eq!(alone[0].rows[0].name, NAME);
    assert!(alone[0].rows[0].figures.iter().all(Option::is_some), "{}", alone[0]);
}
