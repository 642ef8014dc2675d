//! The summary of a campaign: a line for each kind of fault, and every run that failed.

use super::Run;
use super::fault::Kind;
use super::judge::AgainstTruth;
use super::scene::Scene;
use clap::ValueEnum;
use std::fmt;

/// Runs with one kind of fault, by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Line {
    pub runs: usize,
    pub reported: usize,
    pub harmless: usize,
    pub bounded: usize,
    pub failed: usize,
    /// Reported runs in which a later second that was marked good again had an error beyond the limit.
    pub grown: usize,
    /// Largest ratio of the moved yaw to its limit, without the bounded runs.
    pub moved_limits: f64,
    /// The longest time to a report, s.
    pub reported_after: f64,
}

impl Line {
    pub fn new<'r>(runs: impl Iterator<Item = &'r Run>) -> Self {
        let mut line = Self::default();
        for run in runs {
            line.runs += 1;
            line.failed += usize::from(run.is_failure());
            let Ok(outcome) = &run.outcome else { continue };
            let after = outcome.reported_after.filter(|_| !outcome.is_undetected());
            line.reported += usize::from(after.is_some());
            line.reported_after = line.reported_after.max(after.unwrap_or_default());
            line.harmless += usize::from(outcome.is_harmless());
            line.grown += usize::from(outcome.grown_limits > 1.0);
            if run.is_bounded() {
                line.bounded += 1;
            } else {
                line.moved_limits = line.moved_limits.max(outcome.moved_limits);
            }
        }
        line
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { runs, reported, harmless, bounded, failed, grown, moved_limits, reported_after } = self;
        write!(
            f,
            "{runs} runs: {reported} reported after at most {reported_after:.3} s ({grown} with an error beyond the \
             limit later), {harmless} harmless, {bounded} bounded, {failed} failed; yaw moved by {moved_limits:.2} of \
             the limit"
        )
    }
}

pub struct Report<'r>(pub &'r [Scene<'r>], pub &'r [Run]);

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(scenes, runs) = self;
        for scene in *scenes {
            write!(f, "undamaged: {}, {}: ", scene.drive.name, scene.part)?;
            let Some(errors) = scene.baseline.against_truth() else {
                writeln!(f, "no reference")?;
                continue;
            };
            let AgainstTruth { seconds, mean, largest, inside_sigma, in_order } = errors;
            let mark = if in_order { "" } else { ", OVER THE LIMITS" };
            let inside = inside_sigma.map_or(String::new(), |share| format!(", {share:.2} inside sigma"));
            writeln!(f, "{seconds} s, error {mean:.1e} rad in 1 s, at most {largest:.1e}{inside}{mark}")?;
        }
        let single = |kind: &'static Kind| {
            runs.iter().filter(move |run| run.faults.len() == 1 && run.faults[0].kind == *kind)
        };
        for kind in Kind::value_variants() {
            writeln!(f, "{kind:?}: {}", Line::new(single(kind)))?;
        }
        writeln!(f, "pairs: {}", Line::new(runs.iter().filter(|run| run.faults.len() > 1)))?;
        writeln!(f, "all: {}", Line::new(runs.iter()))?;
        for Run { number, drive, part, faults, outcome } in runs.iter().filter(|run| run.is_failure()) {
            writeln!(f, "FAILED run {number}, {drive}, {part}: {faults:?}: {outcome:?}")?;
        }
        Ok(())
    }
}
