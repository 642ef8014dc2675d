//! This module summarises a campaign, with one line for each kind of fault.

use super::Run;
use super::exceptions::EXCEPTIONS;
use super::fault::{Fault, Kind};
use super::judge::AgainstTruth;
use super::scene::Scene;
use serde::Serialize;
use std::fmt;

/// Holds the median and the largest of some values.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The largest.
    pub most: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let median = values.get(values.len() / 2).copied().unwrap_or_default();
        Self { median, most: values.last().copied().unwrap_or_default() }
    }
}

/// Summarises the runs with one kind of fault.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Line {
    /// Name of the kind of fault.
    pub name: String,
    /// Number of runs.
    pub runs: usize,
    /// Runs in which a receiver reported the fault in time.
    pub reported: usize,
    /// Runs without a report in which yaw did not move by more than the limit.
    pub harmless: usize,
    /// Harmless runs in which the board counted an event.
    pub counted: usize,
    /// Undetected runs that an exception covers.
    pub excepted: usize,
    /// Undetected runs that no exception covers.
    pub undetected: usize,
    /// Runs that panicked.
    pub panics: usize,
    /// Time from the first effect to the report, s.
    pub reported_after: Spread,
    /// Largest yaw moved in a good second before the first report, without the excepted runs, rad.
    pub moved: f64,
    /// The largest ratio of that to the limit.
    pub moved_limits: f64,
    /// Largest growth of a good second's error after the last report, divided by the limit.
    pub grown_limits: f64,
    /// Runs in which the error grew by more than the limit.
    pub grown: usize,
    /// Largest error against the reference in a good second, rad.
    pub error: f64,
    /// Time from the end of the fault to the last report, s.
    pub recovery: Spread,
    /// Runs that were still reported at their end, though the fault was over.
    pub not_recovered: usize,
}

/// Holds an exception and the runs that it covers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Excepted {
    /// Name of the exception.
    pub name: &'static str,
    /// The reason why nothing detects it.
    pub why: &'static str,
    /// Number of runs that it covers.
    pub runs: usize,
    /// Largest yaw that they moved in a good second, rad.
    pub moved: f64,
}

/// Describes an undamaged drive with which every run is compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Undamaged {
    /// Name of the drive.
    pub drive: String,
    /// Name of the part.
    pub part: &'static str,
    /// Errors of the drive; `None` where the drive has no reference.
    pub errors: Option<AgainstTruth>,
}

/// Describes a run that failed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Index of the run.
    pub run: usize,
    /// Name of the drive.
    pub drive: String,
    /// Name of the part.
    pub part: &'static str,
    /// The faults.
    pub faults: Vec<Fault>,
    /// Description of the failure.
    pub what: String,
}

/// Holds the results of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The seed.
    pub seed: u64,
    /// The undamaged drives.
    pub undamaged: Vec<Undamaged>,
    /// Single faults by kind, then pairs, then all.
    pub lines: Vec<Line>,
    /// The exceptions and their runs.
    pub exceptions: Vec<Excepted>,
    /// Runs that failed.
    pub failures: Vec<Failure>,
}

impl Report {
    /// Returns the undamaged drives whose errors exceed their limits.
    pub fn out_of_order(&self) -> impl Iterator<Item = &Undamaged> {
        self.undamaged.iter().filter(|drive| drive.errors.is_some_and(|errors| !errors.in_order))
    }

    /// Summarises the runs of these scenes.
    #[must_use]
    pub fn new(seed: u64, scenes: &[Scene<'_>], runs: &[Run]) -> Self {
        let undamaged = scenes.iter().map(|scene| Undamaged {
            drive: scene.drive.name.clone(),
            part: scene.part.name(),
            errors: scene.baseline.against_truth(),
        });
        let single = |run: &&Run| run.faults.len() == 1;
        let of = |kind| runs.iter().filter(single).filter(move |run| run.faults[0].kind == kind);
        let mut lines: Vec<Line> = Kind::ALL.iter().map(|kind| line(kind.name(), of(*kind))).collect();
        lines.push(line("pairs of these", runs.iter().filter(|run| run.faults.len() > 1)));
        lines.push(line("all", runs.iter()));
        let exceptions = EXCEPTIONS.iter().map(|exception| {
            let own = || runs.iter().filter(|run| run.exception().is_some_and(|e| e.name == exception.name));
            let moved = own().filter_map(Run::outcome).map(|outcome| outcome.moved).fold(0.0, f64::max);
            Excepted { name: exception.name, why: exception.why, runs: own().count(), moved }
        });
        let failures = runs.iter().filter(|run| run.is_failure()).map(|run| Failure {
            run: run.number,
            drive: run.drive.clone(),
            part: run.part.name(),
            faults: run.faults.clone(),
            what: match &run.outcome {
                Err(panic) => format!("panic: {panic}"),
                Ok(outcome) => {
                    format!("{:.2e} rad, {:.1} times the limit", outcome.moved, outcome.moved_limits)
                }
            },
        });
        Self {
            seed,
            undamaged: undamaged.collect(),
            lines,
            exceptions: exceptions.collect(),
            failures: failures.collect(),
        }
    }
}

fn line<'r>(name: &str, runs: impl Iterator<Item = &'r Run>) -> Line {
    let mut line = Line { name: name.to_owned(), ..Line::default() };
    let (mut reported_after, mut recovery) = (Vec::new(), Vec::new());
    for run in runs {
        line.runs += 1;
        let Some(outcome) = run.outcome() else {
            line.panics += 1;
            continue;
        };
        reported_after.extend(outcome.reported_after);
        line.reported += usize::from(outcome.reported_after.is_some() && !outcome.is_undetected());
        line.harmless += usize::from(outcome.is_harmless());
        line.counted += usize::from(outcome.is_harmless() && outcome.counted);
        let excepted = run.exception().is_some();
        line.excepted += usize::from(excepted);
        line.undetected += usize::from(run.is_failure());
        if !excepted {
            line.moved = line.moved.max(outcome.moved);
            line.moved_limits = line.moved_limits.max(outcome.moved_limits);
        }
        line.grown += usize::from(outcome.grown_limits > 1.0);
        line.grown_limits = line.grown_limits.max(outcome.grown_limits);
        line.error = line.error.max(outcome.error);
        if outcome.reported_after.is_some() {
            recovery.push(outcome.recovery);
        }
        line.not_recovered += usize::from(outcome.not_recovered);
    }
    line.reported_after = Spread::of(reported_after);
    line.recovery = Spread::of(recovery);
    line
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Undamaged { drive, part, errors } in &self.undamaged {
            match errors {
                Some(AgainstTruth { seconds, mean, largest, inside_sigma, in_order }) => {
                    let mark = if *in_order { "" } else { "OVER THE LIMITS " };
                    write!(
                        f,
                        "{mark}undamaged: {drive}, {part}: {seconds} s, error {mean:.1e} rad in 1 s, at most {largest:.1e}"
                    )?;
                    match inside_sigma {
                        Some(share) => writeln!(f, ", {share:.2} inside the stated error")?,
                        None => writeln!(f)?,
                    }
                }
                None => writeln!(f, "undamaged: {drive}, {part}: no reference")?,
            }
        }
        writeln!(
            f,
            "{:<15} {:>6} {:>8} {:>8} {:>7} {:>10} {:>6}  {:>13}  {:>7}  {:>8} {:>6}  {:>13} {:>5}",
            "fault",
            "runs",
            "reported",
            "harmless",
            "named",
            "undetected",
            "panics",
            "reported ms",
            "moved/l",
            "grown/l",
            "runs",
            "recovery s",
            "never"
        )?;
        for line in &self.lines {
            let ms = |value: f64| 1e3 * value;
            writeln!(
                f,
                "{:<15} {:>6} {:>8} {:>8} {:>7} {:>10} {:>6}  {:>6.0} {:>6.0}  {:>7.2}  {:>8.2} {:>6}  {:>6.2} {:>6.2} {:>5}",
                line.name,
                line.runs,
                line.reported,
                line.harmless,
                line.excepted,
                line.undetected,
                line.panics,
                ms(line.reported_after.median),
                ms(line.reported_after.most),
                line.moved_limits,
                line.grown_limits,
                line.grown,
                line.recovery.median,
                line.recovery.most,
                line.not_recovered,
            )?;
        }
        for Excepted { name, why, runs, moved } in &self.exceptions {
            writeln!(f, "named: {name}: {runs} runs, at most {moved:.1e} rad in a second: {why}")?;
        }
        for Failure { run, drive, part, faults, what } in &self.failures {
            let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
            writeln!(f, "UNDETECTED run {run}, {drive}, {part}: {what}: {}", faults.join(" and "))?;
        }
        Ok(())
    }
}
