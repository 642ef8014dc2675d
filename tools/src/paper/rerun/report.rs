//! This module writes the report of a run: the result of each step, the missing and omitted sequences with the
//! reasons, a summary of each sequence's files, and the tables.

use super::plan::Effort;
use super::run::{Outcome, Outcomes, log};
use super::split::Split;
use crate::simulate::layout::Layout;
use serde::Serialize;
use std::fmt::{self, Write};
use std::fs;
use std::path::Path;

/// Holds the results of a data set.
#[derive(Debug, Serialize)]
pub struct Set {
    /// The sequences and their roles.
    #[serde(flatten)]
    pub split: Split,
    /// The steps and their outcomes.
    pub steps: Outcomes,
}

/// Holds the results of a run.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Says how the networks were trained.
    pub effort: Effort,
    /// The data sets.
    pub sets: Vec<Set>,
}

impl Set {
    fn title(&self) -> &'static str {
        match self.split.layout {
            Layout::Kaist => "KAIST Urban",
            Layout::Nclt => "NCLT",
        }
    }

    /// Returns the steps without a result, each with the reason.
    pub fn left_out(&self) -> impl Iterator<Item = (&str, &str)> {
        self.steps.iter().filter_map(|(name, outcome)| match outcome {
            Outcome::Failed(why) | Outcome::LeftOut(why) => Some((name.as_str(), why.as_str())),
            Outcome::Made(_) | Outcome::Kept(_) => None,
        })
    }
}

impl Report {
    /// Returns one line for each missing, unused and omitted item, which the tables do not contain.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for set in &self.sets {
            if !set.split.missing.is_empty() {
                let (count, names) = (set.split.missing.len(), set.split.missing.join(", "));
                lines.push(format!("{}: missing {count}: {names}", set.title()));
            }
            lines.extend(set.split.unused.iter().map(|why| format!("{}: not used: {why}", set.title())));
            lines.extend(set.left_out().map(|(name, why)| format!("{name}: left out: {why}")));
        }
        lines
    }

    /// Returns whether every step has a result.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.sets.iter().all(|set| set.left_out().next().is_none())
    }

    /// Returns the report in Markdown; the logs of the steps are below `out`.
    ///
    /// # Errors
    /// Only the formatter's error.
    pub fn markdown(&self, out: &Path) -> Result<String, fmt::Error> {
        let mut text = String::from("# The paper's tables, run again\n\n");
        if self.sets.iter().any(|set| set.split.members.iter().any(|member| member.device.is_some())) {
            writeln!(text, "**Some sequences are simulated: their figures are not from a real drive.**\n")?;
        }
        if self.effort != Effort::FULL {
            writeln!(text, "**Not trained as by default:** {:?}\n", self.effort)?;
        }
        text += "## Missing and left out\n\n";
        let remarks = self.remarks();
        remarks.iter().try_for_each(|line| writeln!(text, "- {line}"))?;
        if remarks.is_empty() {
            text += "Nothing.\n";
        }
        text += "\nTrained on the paper's training sequences; its validation sequences, which the tables have too, chose epochs \
                 and seeds. The paper names none for NCLT: here they are the last two of its 18. The rivals read only the layout \
                 of KAIST Urban. Training cuts sequences at gaps; tests bridge gaps.\n";
        for set in &self.sets {
            self.set(set, out, &mut text)?;
        }
        Ok(text)
    }

    fn set(&self, set: &Set, out: &Path, text: &mut String) -> fmt::Result {
        let title = set.title();
        writeln!(text, "\n## {title}\n\n| step | result | s |\n|---|---|---|")?;
        for (name, outcome) in &set.steps {
            let (result, seconds) = match outcome {
                Outcome::Made(seconds) => ("made", *seconds),
                Outcome::Kept(seconds) => ("kept from an earlier run", *seconds),
                Outcome::Failed(_) => ("failed", 0.0),
                Outcome::LeftOut(_) => ("left out", 0.0),
            };
            writeln!(text, "| {name} | {result} | {seconds:.0} |")?;
        }
        let printed = |step: &str| {
            let is_made = set.steps.iter().any(|(name, outcome)| {
                name == step && matches!(outcome, Outcome::Made(_) | Outcome::Kept(_))
            });
            is_made.then(|| fs::read_to_string(log(out, step)).unwrap_or_default())
        };
        let folder = match set.split.layout {
            Layout::Kaist => "kaist",
            Layout::Nclt => "nclt",
        };
        if let Some(tables) = printed(&format!("{folder}/tables")) {
            let page = format!("{folder}/report/report.html");
            writeln!(text, "\n### Tables\n\nWith the figures: [{page}]({page})\n\n```text\n{tables}```")?;
        }
        text.push_str("\n### Sequences\n\n```text\n");
        for member in &set.split.members {
            text.push_str(&printed(&format!("{folder}/{}", member.name)).unwrap_or_default());
        }
        text.push_str("```\n");
        Ok(())
    }
}
