//! The errors and costs of each method on each drive, as a table and as JSON.

use crate::drive::error::{DataError, DataFault};
use crate::drive::stream::Drive;
use crate::drive::{DT, recording};
use crate::evaluate::expected_error::ExpectedError;
use crate::evaluate::heading_error::{AgainstCourse, AgainstRate, Errors, HeadingError, PLAUSIBLE_10S_RAD};
use crate::evaluate::methods::{Method, PerMethod};
use crate::evaluate::rates::{self, Networks, Sample};
use serde::Serialize;
use std::fmt;
use std::path::Path;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    #[serde(flatten)]
    pub error: HeadingError,
    pub delay_ms: u64,
}

/// Title of the table, which heads the methods' names, and headings of all columns.
pub const TITLE: &str = "heading error, deg";
pub const HEADINGS: [&str; 5] = [TITLE, "in 1 s", "in 60 s", "RMS", "at the end"];
/// A method has failed whose error is so many times that of static initialisation.
pub(super) const FAILED: f64 = 10.0;
pub const MARKS: &str =
    "* best classical method of its column; ? failed: ten times static initialisation's error";

/// Returns the name and figures of each method. A dash is a missing figure; [`MARKS`] explains the marks.
pub fn figures(rows: &PerMethod<Row>) -> Vec<Vec<String>> {
    let errors = |row: &Row| {
        let HeadingError { mean_1s_rad, mean_60s_rad, rms_rad, final_rad, .. } = row.error;
        [mean_1s_rad, mean_60s_rad, rms_rad, final_rad]
    };
    let still = &rows[Method::STATIC];
    let best: [Option<f64>; 4] = std::array::from_fn(|column| {
        let errors = Method::CLASSICAL.into_iter().filter_map(|method| errors(&rows[method])[column]);
        errors.min_by(f64::total_cmp)
    });
    let figures = rows.each().map(|(method, row)| {
        let has_failed =
            method != Method::RAW && row.error.rms_rad > still.error.rms_rad.map(|rms| FAILED * rms);
        let mut figures = vec![method.name.to_owned()];
        for ((error, best), decimals) in errors(row).into_iter().zip(best).zip([4, 3, 3, 3]) {
            let is_best = error == best && Method::CLASSICAL.contains(&method);
            let mark = [" ", "*", "?"][if has_failed { 2 } else { usize::from(is_best) }];
            let figure = error.map(|rad| format!("{:.decimals$}{mark}", rad.to_degrees()));
            figures.push(figure.unwrap_or_else(|| "- ".to_owned()));
        }
        figures
    });
    figures.collect()
}

/// Comparison of one of our rates with the best classical method that has the same inputs and no more delay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    pub best_classical: &'static str,
    /// Our error over that method's: the 1 s error, or the RMS over the drive if the reference gives no 1 s error.
    pub ratio: f64,
}

/// Comparison of both rates that are sent with the best classical methods.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparisons {
    pub default: Comparison,
    pub live: Comparison,
}

impl Comparisons {
    /// Compares the rates; `None` if there is no error to compare.
    pub fn new(rows: &PerMethod<Row>) -> Option<Self> {
        let compare = |ours: Method| {
            let Row { error, delay_ms } = rows[ours];
            let classical = Method::CLASSICAL.into_iter();
            let as_fast = classical.filter(|method| rows[*method].delay_ms <= delay_ms);
            let errors = as_fast.filter_map(|method| Some((method, rows[method].error.compared()?)));
            let (best, least) = errors.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
            Some(Comparison { best_classical: best.key, ratio: error.compared()? / least })
        };
        Some(Self { default: compare(Method::DELAYED)?, live: compare(Method::LIVE)? })
    }
}

impl fmt::Display for Comparisons {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { default, live } = self;
        write!(
            f,
            "{:.2} of the best classical method ({}); live rate {:.2} ({})",
            default.ratio, default.best_classical, live.ratio, live.best_classical
        )
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriveErrors {
    pub name: String,
    pub set: String,
    /// The length of the comparison, s.
    pub seconds: f64,
    /// Number of grid steps without a sample; they are left out of every method's errors.
    pub missing: u32,
    pub reference: &'static str,
    /// The mean of the reference rate at rest, which was taken off; `None` where no wheel shows the rest.
    pub reference_bias_deg_h: Option<f64>,
    pub wheels: bool,
    /// True if the standstill at the start is simulated.
    pub simulated_rest: bool,
    pub over_best_classical: Option<Comparisons>,
    /// Seconds inside one expected error; `None` against a course.
    pub expected_error: Option<ExpectedError>,
    pub methods: PerMethod<Row>,
}

impl DriveErrors {
    /// Runs every method on a drive and compares the rates with its reference. Each sample is passed to `visit`.
    pub fn of(
        drive: &Drive<'_>,
        networks: Networks<'_>,
        mut visit: impl FnMut(&Sample),
    ) -> Result<Self, DataError> {
        let mut judges = Judges::default();
        let comparison = rates::run(drive, networks, |sample| {
            judges.add(sample);
            visit(sample);
        })?;
        let refused = |reason: String| Err(DataError::because(&drive.path, reason));
        let Judges { samples, without_rate, has_course, methods, expected_error } = judges;
        let seconds = samples as f64 * DT;
        let (reference, judged): (_, [Option<Errors>; _]) = match without_rate {
            None => ("ref_gyr_z", methods.each_ref().map(|method| method.rate.errors())),
            Some(_) if has_course => {
                ("ref_yaw", methods.each_ref().map(|method| method.course.clone().errors()))
            }
            Some(line) => return Err(DataError::at(&drive.path, line, DataFault::NoReference)),
        };
        let errors = PerMethod::of(judged);
        let Some(still) = errors.get(Method::STATIC) else {
            return refused(format!(
                "{reference} is known for too short a time in the {seconds:.2} s after static initialisation: at least 1 s \
                 of yaw rate or 20 s of course is needed"
            ));
        };
        if let Some(rad) = still.typical_10s.filter(|rad| *rad > PLAUSIBLE_10S_RAD) {
            return refused(format!(
                "{reference} disagrees with the gyro by {rad:.2} rad in 10 s: a wrong unit, sign or clock, or another \
                 drive; `gyronet doctor` says which"
            ));
        }
        let methods = PerMethod::new(|method| {
            Some(Row { error: errors.get(method)?.figures, delay_ms: method.delay_ms() })
        });
        Ok(Self {
            name: drive.name().to_owned(),
            set: recording::set(Path::new(&drive.path)),
            seconds,
            missing: comparison.missing,
            reference,
            reference_bias_deg_h: drive.facts.reference_bias.map(|rate| 3600.0 * rate.to_degrees()),
            wheels: drive.facts.has_wheels(),
            simulated_rest: comparison.simulated_rest,
            over_best_classical: Comparisons::new(&methods),
            expected_error: (reference == "ref_gyr_z").then_some(expected_error),
            methods,
        })
    }
}

#[derive(Default)]
struct Judges {
    samples: usize,
    /// The first line without a true yaw rate.
    without_rate: Option<u64>,
    has_course: bool,
    methods: [Judge; Method::ON_A_DRIVE.len()],
    expected_error: ExpectedError,
}

/// The errors of one method in progress, against either reference.
#[derive(Default)]
struct Judge {
    rate: AgainstRate,
    course: AgainstCourse,
}

impl Judges {
    fn add(&mut self, sample: &Sample) {
        if !sample.step.is_compared {
            return;
        }
        let row = &sample.step.input;
        self.samples += 1;
        if row.reference.is_none() {
            self.without_rate = self.without_rate.or(Some(row.line));
        }
        self.has_course |= row.course.is_some();
        if let Some((sent, truth)) = sample.step.delayed.zip(row.reference) {
            self.expected_error.add(&sent, truth);
        }
        for (judge, rate) in self.methods.iter_mut().zip(sample.rates.values()) {
            let Some(rate) = *rate else { continue };
            if let Some(truth) = row.reference {
                judge.rate.add(rate, truth);
            }
            judge.course.add(rate, row.course);
        }
    }
}

/// The mean over some drives with equal weights. Each figure is the mean over the drives that have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mean {
    pub set: String,
    pub drives: usize,
    pub over_best_classical: Option<Comparisons>,
    pub methods: PerMethod<Row>,
}

impl Mean {
    fn new(set: &str, drives: &[&DriveErrors]) -> Self {
        let methods = PerMethod::new(|method| {
            let rows: Vec<Row> =
                drives.iter().map(|drive| drive.methods.get(method).copied()).collect::<Option<_>>()?;
            let error = HeadingError::mean(&rows.iter().map(|row| row.error).collect::<Vec<_>>());
            Some(Row { error, delay_ms: method.delay_ms() })
        });
        let over_best_classical = Comparisons::new(&methods);
        Self { set: set.to_owned(), drives: drives.len(), over_best_classical, methods }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    pub drives: Vec<DriveErrors>,
    pub sets: Vec<Mean>,
}

impl Report {
    pub fn new(drives: Vec<DriveErrors>) -> Self {
        let mut names: Vec<&String> = Vec::new();
        for drive in &drives {
            if !names.contains(&&drive.set) {
                names.push(&drive.set);
            }
        }
        let of = |set: &String| drives.iter().filter(|drive| drive.set == *set).collect::<Vec<_>>();
        let sets = names.iter().map(|set| Mean::new(set, &of(set))).collect();
        Self { drives, sets }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for drive in &self.drives {
            let DriveErrors { name, seconds, reference, missing, .. } = drive;
            write!(f, "{name}: {seconds:.1} s after static initialisation, against {reference}, ")?;
            if let Some(bias) = drive.reference_bias_deg_h.filter(|bias| bias.abs() >= 0.05) {
                write!(f, "less its {bias:.1} deg/h at rest, ")?;
            }
            write!(f, "{}", if drive.wheels { "with wheels" } else { "no wheels" })?;
            if *missing > 0 {
                write!(f, ", {missing} samples missing")?;
            }
            if drive.simulated_rest {
                write!(f, "; starts in motion: 3 s at rest are simulated, with the best constant bias")?;
            }
            writeln!(f)?;
            if let Some(expected_error) = drive.expected_error {
                writeln!(f, "  {expected_error}")?;
            }
            table(f, drive.over_best_classical, &drive.methods)?;
        }
        for Mean { set, drives, over_best_classical, methods } in &self.sets {
            if *drives > 1 {
                writeln!(f, "mean of {drives} drives{}{set}", if set.is_empty() { "" } else { " of " })?;
                table(f, *over_best_classical, methods)?;
            }
        }
        writeln!(f, "{MARKS}")
    }
}

fn table(f: &mut fmt::Formatter<'_>, ours: Option<Comparisons>, rows: &PerMethod<Row>) -> fmt::Result {
    if let Some(ours) = ours {
        writeln!(f, "  delayed rate: {ours}")?;
    }
    fmt::Display::fmt(&Table { rows, few: false }, f)?;
    writeln!(f)
}

pub struct Table<'a> {
    pub rows: &'a PerMethod<Row>,
    /// Only the gyro alone, static initialisation without and with zero-rate updates, the best classical methods, and the
    /// rates that are sent.
    pub few: bool,
}

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = figures(self.rows);
        let always = [Method::RAW, Method::STATIC, Method::STATIC_ZERO_RATE, Method::LIVE, Method::DELAYED];
        let always = always.map(|method| method.name);
        let is_best = |row: &[String]| row.iter().any(|figure| figure.ends_with('*'));
        rows.retain(|row| !self.few || is_best(row) || always.contains(&row[0].as_str()));
        rows.insert(0, HEADINGS.map(String::from).into());
        for row in rows {
            let mut line = format!("  {:<26}", row[0]);
            row[1..].iter().for_each(|figure| line += &format!("{figure:>12}"));
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(k: u32, set: &str, reference: &'static str) -> DriveErrors {
        let methods = PerMethod::new(|method| {
            let error = f64::from(k)
                * match method {
                    Method::RAW => 1.0,
                    Method::FIR_ZERO_RATE => 0.3125,
                    Method::STATIC_ZERO_RATE => 0.375,
                    Method::DELAYED => 0.25,
                    _ => 0.5,
                };
            let rate = (reference == "ref_gyr_z").then_some(error);
            let error = HeadingError {
                mean_1s_rad: rate,
                mean_60s_rad: Some(error),
                rms_rad: Some(error),
                final_rad: Some(2.0 * error),
            };
            let delay_ms = match method {
                Method::FIR_ZERO_RATE => 50,
                Method::DELAYED => 70,
                _ => 0,
            };
            Some(Row { error, delay_ms })
        });
        DriveErrors {
            name: format!("drive{k}"),
            set: set.into(),
            seconds: 10.0,
            missing: 0,
            reference,
            reference_bias_deg_h: None,
            wheels: false,
            simulated_rest: reference == "ref_yaw",
            over_best_classical: Comparisons::new(&methods),
            expected_error: None,
            methods,
        }
    }

    fn report() -> Report {
        Report::new(vec![drive(1, "a", "ref_gyr_z"), drive(2, "b", "ref_yaw"), drive(3, "a", "ref_gyr_z")])
    }

    #[test]
    fn json_has_the_documented_names() {
        let json = serde_json::to_value(report()).unwrap();
        let methods = json["drives"][1]["methods"].as_object().unwrap();
        let names: Vec<&str> = methods.keys().map(String::as_str).collect();
        let mut due =
            vec!["raw", "static", "static_zero_rate", "fir", "linear", "vqf", "gyronet_f32", "gyronet_int"];
        due.extend(["live", "default", "fir_zero_rate"]);
        due.sort_unstable();
        assert_eq!(names, due);
        let row = json["drives"][1]["methods"]["default"].as_object().unwrap();
        let mut due = vec!["mean_1s_rad", "mean_60s_rad", "rms_rad", "final_rad", "delay_ms"];
        due.sort_unstable();
        assert_eq!(row.keys().map(String::as_str).collect::<Vec<_>>(), due);
        assert!(row["mean_1s_rad"].is_null());
        assert_eq!((&row["rms_rad"], &row["final_rad"]), (&0.5.into(), &1.0.into()));
        // A mean covers only the drives that have the figure.
        assert_eq!(json["sets"][0]["methods"]["raw"]["mean_1s_rad"], 2.0);
        assert_eq!(json["sets"][0]["methods"]["raw"]["rms_rad"], 2.0);
        let sets = json["sets"].as_array().unwrap().iter().map(|set| (&set["set"], &set["drives"]));
        assert_eq!(sets.collect::<Vec<_>>(), [(&"a".into(), &2.into()), (&"b".into(), &1.into())]);
    }

    #[test]
    fn ours_is_beside_the_best_that_is_no_later() {
        for drive in report().drives {
            let Comparisons { default, live } = drive.over_best_classical.unwrap();
            assert_eq!((default.best_classical, default.ratio), ("fir_zero_rate", 0.8));
            assert_eq!((live.best_classical, live.ratio), ("static_zero_rate", 0.5 / 0.375));
        }
    }

    #[test]
    fn tables_are_aligned_and_80_wide_and_the_ratio_comes_first() {
        let text = report().to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[1].contains("0.80 of the best classical method (fir_zero_rate)"), "{text}");
        let rows = |text: &str| {
            let rows = text.lines().filter(|line| line.starts_with("  ") && !line.contains("classical"));
            rows.map(str::len).collect::<Vec<_>>()
        };
        let widths = rows(&text);
        // The table has three drives and one mean of two.
        assert_eq!(widths.len(), 4 * (1 + Method::ON_A_DRIVE.len()));
        assert!(widths.iter().all(|width| (75..=76).contains(width)), "{text}");
        let fir = lines.iter().find(|line| line.contains(Method::FIR_ZERO_RATE.name)).unwrap();
        assert_eq!(fir.matches('*').count(), 4, "best in each column: {fir}");
        assert!(text.contains("mean of 2 drives of a") && !text.contains("mean of 1"), "{text}");
    }
}
