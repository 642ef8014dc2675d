//! Builds the paper's tables with our results, as rows of text and numbers that [`super::text`] prints.

use super::notes;
use super::paper::{self, Line};
use super::results::{ByMethod, Errors, Group, Results, SequenceErrors, mean};
use gyronet_tools::evaluate::methods::{Gyro, Method};
use std::path::Path;

#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub name: String,
    /// One number for each column; `None` if it is missing.
    pub figures: Vec<Option<f64>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Number of the table in the paper, and its subject.
    pub title: String,
    pub simulated: bool,
    /// Names of the columns of our rows.
    pub columns: Vec<String>,
    pub decimals: usize,
    pub rows: Vec<Row>,
    /// Names of the columns of the paper's rows.
    pub paper_columns: Vec<String>,
    pub paper_rows: Vec<Row>,
    pub notes: Vec<String>,
}

impl Table {
    /// Replaces the remarks on bundled weights by the names of the weight files of GyroNet and FoGNet, if given.
    pub fn with_weights(mut self, files: [Option<&Path>; 2]) -> Self {
        for ((bundled, network), file) in notes::BUNDLED.iter().zip(["GyroNet", "FoGNet"]).zip(files) {
            let Some(file) = file else { continue };
            for note in self.notes.iter_mut().filter(|note| note == bundled) {
                *note = format!("{network}'s weights are {}.", file.display());
            }
        }
        self
    }
}

pub fn tables(results: &Results) -> Vec<Table> {
    let all: Vec<&SequenceErrors> = results.sequences.iter().collect();
    let of = |group| all.iter().copied().filter(|s| s.group == group).collect::<Vec<&SequenceErrors>>();
    let first = of(Group::First);
    let mut tables = Vec::new();
    tables.extend(some(&all, orientation));
    tables.extend(some(&first, urban));
    tables.extend(some(&all, padding).filter(|table| !table.rows.is_empty()));
    // The paper has Table IV for three of its sequences; here it also has all simulated ones of the first group.
    let with_rivals: Vec<&SequenceErrors> = first
        .iter()
        .copied()
        .filter(|s| s.simulated || paper::RINS_W.iter().any(|(name, _)| *name == s.name))
        .collect();
    tables.extend(some(&with_rivals, rivals).filter(|table| !table.columns.is_empty()));
    for (group, what) in [
        (Group::NewlyReleased, "newly released sequences"),
        (Group::OtherDevices, "sequences of other devices"),
    ] {
        tables.extend(some(&of(group), |set| later(set, what)));
    }
    tables
}

fn some(set: &[&SequenceErrors], table: impl FnOnce(&[&SequenceErrors]) -> Table) -> Option<Table> {
    (!set.is_empty()).then(|| table(set))
}

/// Returns the wanted methods that at least one sequence has, in order of appearance.
fn methods_of(set: &[&SequenceErrors], is_wanted: impl Fn(&Method) -> bool) -> Vec<Method> {
    let mut methods: Vec<Method> = Vec::new();
    for method in set.iter().flat_map(|sequence| &sequence.order) {
        if is_wanted(method) && !methods.contains(method) {
            methods.push(*method);
        }
    }
    methods
}

fn lines(lines: &[Line]) -> Vec<Row> {
    let row = |(name, figures): &Line| Row {
        name: (*name).to_owned(),
        figures: figures.iter().copied().map(Some).collect(),
    };
    lines.iter().map(row).collect()
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn figures(errors: Option<&Errors>, of: &[fn(&Errors) -> f64]) -> Vec<Option<f64>> {
    of.iter().map(|of| errors.map(of)).collect()
}

fn orientation(set: &[&SequenceErrors]) -> Table {
    let means: ByMethod = mean(set.iter().copied());
    let of: [fn(&Errors) -> f64; 3] = [|e| e.mean_1s_rad, |e| e.final_rad, |e| e.final_unwrapped_rad];
    let rows = methods_of(set, |_| true)
        .into_iter()
        .map(|method| Row { name: method.name.to_owned(), figures: figures(means.get(method.key), &of) });
    Table {
        title: format!("Table I: orientation error on KAIST Urban, mean of {} sequences, rad", set.len()),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: names(&["in 1 s", "final", "final, not wrapped"]),
        decimals: 6,
        rows: rows.collect(),
        paper_columns: names(&["in 1 s", "final"]),
        paper_rows: lines(&paper::ORIENTATION),
        notes: notes::orientation(set, &means),
    }
}

const ATE: [fn(&Errors) -> f64; 2] = [|e| e.ate_m, |e| e.aligned_ate_m];

/// Returns a row for each sequence with the ATE and aligned ATE of each method, and a row with their averages.
fn by_sequence(
    set: &[&SequenceErrors],
    methods: &[Method],
    name: impl Fn(&SequenceErrors) -> String,
) -> Vec<Row> {
    let row = |name: String, by: &ByMethod| Row {
        name,
        figures: methods.iter().flat_map(|method| figures(by.get(method.key), &ATE)).collect(),
    };
    let average = row("average".into(), &mean(set.iter().copied()));
    set.iter().map(|s| row(name(s), &s.methods)).chain([average]).collect()
}

fn urban(set: &[&SequenceErrors]) -> Table {
    let is_wanted = |method: &Method| {
        method.gyro != Gyro::Mems || [Method::STATIC.key, Method::GYRONET.key].contains(&method.key)
    };
    let methods = methods_of(set, is_wanted);
    let mut paper_rows = lines(&paper::URBAN);
    paper_rows.extend(lines(&[paper::URBAN_AVERAGE]));
    for (name, lines) in [
        ("average, recomputed", &paper::URBAN[..]),
        ("its training sequences, 06 to 13", &paper::URBAN[..8]),
        ("its test sequences, 14 to 17", &paper::URBAN[8..]),
    ] {
        let figures = paper::average(lines).into_iter().map(Some).collect();
        paper_rows.push(Row { name: name.into(), figures });
    }
    Table {
        title: String::from("Table II: ATE and aligned ATE of dead reckoning with each yaw rate, rmse, m"),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: pairs(methods.iter().map(|method| method.name)),
        decimals: 2,
        rows: by_sequence(set, &methods, |s| format!("{}, {:.1} km", s.name, s.metres / 1e3)),
        paper_columns: pairs(["FoG", "lwoi", "FoGNet"].into_iter()),
        paper_rows,
        notes: notes::with_fognet(
            set,
            &[
                "The paper does not say whether its ATE is the rmse or the mean; ours is the rmse, and the JSON has both.",
                "Its printed averages include the sequences that it trained on.",
            ],
        ),
    }
}

fn rivals(set: &[&SequenceErrors]) -> Table {
    let methods = methods_of(set, |method| method.gyro == Gyro::Given || method.key == Method::FOGNET.key);
    let mut paper_rows = lines(&paper::RINS_W);
    paper_rows.extend(lines(&[paper::RINS_W_AVERAGE]));
    let figures = paper::average(&paper::RINS_W).into_iter().map(Some).collect();
    paper_rows.push(Row { name: "average, recomputed".into(), figures });
    Table {
        title: String::from("Table IV: ATE and aligned ATE beside RINS-W, m"),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: pairs(methods.iter().map(|method| method.name)),
        decimals: 2,
        rows: by_sequence(set, &methods, |s| s.name.clone()),
        paper_columns: pairs(["RINS-W", "FoGNet"].into_iter()),
        paper_rows,
        notes: notes::rivals(set),
    }
}

fn pairs<'a>(labels: impl Iterator<Item = &'a str>) -> Vec<String> {
    labels.flat_map(|label| [format!("{label}: ATE"), String::from("aligned")]).collect()
}

/// Builds Table III; it has no rows if FoGNet was not run.
fn padding(set: &[&SequenceErrors]) -> Table {
    let means = mean(set.iter().copied());
    let rows =
        [("no padding", "fognet_nopad"), ("padding", "fognet")].into_iter().filter_map(|(name, key)| {
            Some(Row { name: name.into(), figures: figures(Some(means.get(key)?), &ATE) })
        });
    averages(set, "Table III: padding, average ATE, m".into(), rows.collect(), &paper::PADDING)
}

fn later(set: &[&SequenceErrors], what: &str) -> Table {
    let means = mean(set.iter().copied());
    let rows = methods_of(set, |_| true).into_iter().map(|method| Row {
        name: match method.gyro {
            Gyro::Mems | Gyro::Fog => format!("{} + odometry", method.name),
            Gyro::Wheels | Gyro::Given => method.name.to_owned(),
        },
        figures: figures(means.get(method.key), &ATE),
    });
    let title = format!("Table V: average ATE on {what}, {} sequences, m", set.len());
    averages(set, title, rows.collect(), &paper::NEW_SEQUENCES)
}

fn averages(set: &[&SequenceErrors], title: String, rows: Vec<Row>, paper: &[Line]) -> Table {
    Table {
        title,
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: names(&["ATE", "aligned"]),
        decimals: 2,
        rows,
        paper_columns: names(&["ATE", "aligned"]),
        paper_rows: lines(paper),
        notes: notes::with_fognet(set, &[]),
    }
}
