//! This module makes the paper's tables with our figures: rows of words and numbers, which [`super::text`] and
//! [`super::html`] print.

use super::paper::{self, Line};
use super::results::{ByMethod, Errors, Results, SequenceErrors, mean};
use crate::evaluate::methods::{Gyro, Method};
use crate::simulate::layout::Layout;

/// Holds a row: a name and figures; `None` for a missing one.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The name of the row.
    pub name: String,
    /// One figure for each column.
    pub figures: Vec<Option<f64>>,
}

/// Holds a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Its number in the paper and its subject.
    pub title: String,
    /// Says whether it holds figures of simulated drives.
    pub simulated: bool,
    /// Names of the columns of figures.
    pub columns: Vec<String>,
    /// Decimals of the figures.
    pub decimals: usize,
    /// Our rows.
    pub rows: Vec<Row>,
    /// The columns of the paper's rows.
    pub paper_columns: Vec<String>,
    /// The paper's rows.
    pub paper_rows: Vec<Row>,
    /// Remarks below the table.
    pub notes: Vec<String>,
}

/// Returns all tables that the sequences have figures for.
#[must_use]
pub fn tables(results: &Results) -> Vec<Table> {
    let kaist: Vec<&SequenceErrors> =
        results.sequences.iter().filter(|sequence| sequence.layout == Layout::Kaist).collect();
    let nclt: Vec<&SequenceErrors> =
        results.sequences.iter().filter(|sequence| sequence.layout == Layout::Nclt).collect();
    let (others, first): (Vec<&SequenceErrors>, Vec<&SequenceErrors>) =
        kaist.iter().partition(|sequence| sequence.other_devices);
    let mut tables = Vec::new();
    for (set, name) in [(&kaist, "KAIST Urban"), (&nclt, "NCLT")] {
        tables.extend(some(set, |set| orientation(set, name)));
    }
    tables.extend(some(&first, urban));
    tables.extend(some(&kaist, padding).filter(|table| !table.rows.is_empty()));
    let with_rivals: Vec<&SequenceErrors> =
        kaist.iter().copied().filter(|s| paper::RINS_W.iter().any(|line| line.name == s.name)).collect();
    tables.extend(some(&with_rivals, rivals));
    tables.extend(some(&others, |set| {
        let what = if set.iter().any(|s| s.simulated) { "of other devices" } else { "recorded later" };
        average(set, &format!("Table V: average ATE on sequences {what}"), &paper::NEW_SEQUENCES)
    }));
    tables.extend(some(&kaist, run_time));
    tables.extend(some(&nclt, |set| average(set, "Table VII: average ATE on NCLT", &paper::NCLT)));
    tables
}

fn some(set: &[&SequenceErrors], table: impl FnOnce(&[&SequenceErrors]) -> Table) -> Option<Table> {
    (!set.is_empty()).then(|| table(set))
}

/// Returns the methods that some sequence has, in their order.
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
    let row = |line: &Line| Row {
        name: line.name.to_owned(),
        figures: line.figures.iter().copied().map(Some).collect(),
    };
    lines.iter().map(row).collect()
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn figures(errors: Option<&Errors>, of: &[fn(&Errors) -> f64]) -> Vec<Option<f64>> {
    of.iter().map(|of| errors.map(of)).collect()
}

/// Makes Table I for either data set; the paper has it for KAIST alone.
fn orientation(set: &[&SequenceErrors], data_set: &str) -> Table {
    let means: ByMethod = mean(set.iter().copied());
    let of: [fn(&Errors) -> f64; 3] = [|e| e.mean_1s_rad, |e| e.final_rad, |e| e.final_unwrapped_rad];
    let rows = methods_of(set, |_| true)
        .into_iter()
        .map(|method| Row { name: method.name.to_owned(), figures: figures(means.get(method.key), &of) });
    let mut notes = vec![
        "The paper's figures are for KAIST Urban.".into(),
        "Errors are against the data set's truth.".into(),
        "Unlike the paper's, our GyroNet and our FIR get readings less the mean of static initialisation."
            .into(),
    ];
    let [still, network, looped] = ["static", "gyronet", "gyronet_loop"].map(|key| means.get(key));
    if let (Some(still), Some(network), Some(looped)) = (still, network, looped) {
        notes.push(format!(
            "GyroNet's error in 1 s is {:.3} of that of static initialisation, {:.3} with the bias loop; \
             in the paper {:.3}.",
            network.mean_1s_rad / still.mean_1s_rad,
            looped.mean_1s_rad / still.mean_1s_rad,
            paper::GYRONET_TO_STATIC
        ));
    }
    if set.iter().any(|sequence| !sequence.methods.contains_key(Method::VENDOR.key)) {
        notes.push("VQF stands in for the vendor's filter, whose heading these data do not have.".into());
    }
    notes.extend(set.iter().filter_map(|s| Some(format!("{}: {}", s.name, s.refused.as_ref()?))));
    Table {
        title: format!("Table I: orientation error on {data_set}, mean of {} sequences, rad", set.len()),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: names(&["in 1 s", "final", "final, not wrapped"]),
        decimals: 6,
        rows: rows.collect(),
        paper_columns: names(&["in 1 s", "final"]),
        paper_rows: lines(&paper::ORIENTATION),
        notes,
    }
}

const ATE: [fn(&Errors) -> f64; 2] = [|e| e.ate_m, |e| e.aligned_ate_m];

/// Makes Table II.
fn urban(set: &[&SequenceErrors]) -> Table {
    let is_wanted = |method: &Method| {
        method.gyro == Gyro::Fog || [Method::STATIC.key, Method::GYRONET.key].contains(&method.key)
    };
    let methods = methods_of(set, is_wanted);
    let row = |name: String, by: &ByMethod| Row {
        name,
        figures: methods.iter().flat_map(|method| figures(by.get(method.key), &ATE)).collect(),
    };
    let mut rows: Vec<Row> =
        set.iter().map(|s| row(format!("{}, {:.1} km", s.name, s.metres / 1e3), &s.methods)).collect();
    rows.push(row("average".into(), &mean(set.iter().copied())));
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
        rows,
        paper_columns: pairs(["FoG", "lwoi", "FoGNet"].into_iter()),
        paper_rows,
        notes: vec![
            "The paper says neither rmse nor mean; the JSON has both.".into(),
            "Its printed averages include the sequences that it trained on.".into(),
            FOGNET_SIGN.into(),
        ],
    }
}

/// Makes Table IV.
fn rivals(set: &[&SequenceErrors]) -> Table {
    let row = |name: &str, by: &ByMethod| Row {
        name: name.to_owned(),
        figures: figures(by.get(Method::FOGNET.key), &ATE),
    };
    let mut rows: Vec<Row> = set.iter().map(|s| row(&s.name, &s.methods)).collect();
    rows.push(row("average", &mean(set.iter().copied())));
    let mut paper_rows = lines(&paper::RINS_W);
    paper_rows.extend(lines(&[paper::RINS_W_AVERAGE]));
    let figures = paper::average(&paper::RINS_W).into_iter().map(Some).collect();
    paper_rows.push(Row { name: "average, recomputed".into(), figures });
    Table {
        title: String::from("Table IV: ATE and aligned ATE beside RINS-W, m"),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: pairs([Method::FOGNET.name].into_iter()),
        decimals: 2,
        rows,
        paper_columns: pairs(["RINS-W", "FoGNet"].into_iter()),
        paper_rows,
        notes: vec![
            "The paper's averages of RINS-W do not follow from its rows.".into(),
            "RINS-W's figures are the paper's; python -m gyronet_train.rinsw trains and runs it.".into(),
            FOGNET_SIGN.into(),
        ],
    }
}

/// Explains the differences of our FoGNet from the paper's.
const FOGNET_SIGN: &str = "Our FoGNet gives what the gyro has erred by, which is taken off; the paper's gives the prediction less the \
                           measurement, which is added.";
/// Names the training data of the weights of the table's FoGNet.
const WEIGHTS: &str = "The bundled weights were trained on simulated sequences of KAIST's layout.";

fn pairs<'a>(labels: impl Iterator<Item = &'a str>) -> Vec<String> {
    labels.flat_map(|label| [format!("{label}: ATE"), String::from("aligned")]).collect()
}

/// Makes Table III; it has no rows if no method of the list pads.
fn padding(set: &[&SequenceErrors]) -> Table {
    let means = mean(set.iter().copied());
    let rows =
        [("no padding", "fognet_nopad"), ("padding", "fognet")].into_iter().filter_map(|(name, key)| {
            Some(Row { name: name.into(), figures: figures(Some(means.get(key)?), &ATE) })
        });
    Table {
        title: String::from("Table III: padding, average ATE, m"),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: names(&["ATE", "aligned"]),
        decimals: 2,
        rows: rows.collect(),
        paper_columns: names(&["ATE", "aligned"]),
        paper_rows: lines(&paper::PADDING),
        notes: Vec::new(),
    }
}

/// Makes Tables V and VII.
fn average(set: &[&SequenceErrors], title: &str, paper: &[Line]) -> Table {
    let means = mean(set.iter().copied());
    let rows = methods_of(set, |_| true).into_iter().map(|method| Row {
        name: format!("{} + odometry", method.name),
        figures: figures(means.get(method.key), &ATE),
    });
    Table {
        title: format!("{title}, {} sequences, m", set.len()),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: names(&["ATE", "aligned"]),
        decimals: 2,
        rows: rows.collect(),
        paper_columns: names(&["ATE", "aligned"]),
        paper_rows: lines(paper),
        notes: vec![WEIGHTS.into()],
    }
}

/// Makes Table VI.
fn run_time(set: &[&SequenceErrors]) -> Table {
    let hours = set.iter().map(|sequence| sequence.seconds).sum::<f64>() / 3600.0;
    let rows = methods_of(set, |_| true).into_iter().map(|method| Row {
        name: method.name.to_owned(),
        figures: vec![
            set.iter().map(|s| s.methods.get(method.key).map(|e| e.run_time_s)).sum::<Option<f64>>(),
        ],
    });
    Table {
        title: format!("Table VI: total time for {hours:.2} h of driving, this machine, one core, s"),
        simulated: set.iter().any(|sequence| sequence.simulated),
        columns: names(&["s"]),
        decimals: 2,
        rows: rows.collect(),
        paper_columns: names(&["s"]),
        paper_rows: lines(&paper::RUN_TIME),
        notes: vec!["The paper's times are for urban06 to 17.".into()],
    }
}
