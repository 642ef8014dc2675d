//! Examines the sample rate, the gaps, and the rows that cannot be read.

use super::finding::{Finding, Verdict};
use super::recording::{Rows, sorted};
use crate::drive::DT;

/// A longer period than this is a gap, s.
const GAP: f64 = 0.015;
/// Difference from 100 Hz beyond which other commands reject the rate, Hz.
const OFF: f64 = 20.0;

pub fn findings(rows: &Rows) -> Vec<Finding> {
    let mut findings = Vec::new();
    let periods = sorted(rows.seconds.windows(2).map(|pair| pair[1] - pair[0]));
    match periods.get(periods.len() / 2) {
        None => findings.push(Finding::bad("rate", "Fewer than two rows can be read.")),
        Some(median) => {
            let hz = 1.0 / median;
            if (hz - 100.0).abs() > OFF {
                findings.push(Finding::bad(
                    "rate",
                    format!("{hz:.2} Hz by the median period: other commands reject this rate; `gyronet import` resamples to 100 Hz."),
                ));
            } else {
                findings.push(Finding::good("rate", format!("{hz:.2} Hz by the median period.")));
                findings.push(gaps(&periods, rows.len()));
            }
        }
    }
    if rows.bad > 0 {
        let first = rows.first_bad.as_deref().unwrap_or("the recording is longer than a day");
        findings.push(Finding::bad("unreadable rows", format!("{}; the first: {first}.", rows.bad)));
    }
    findings
}

fn gaps(sorted: &[f64], rows: usize) -> Finding {
    let gaps = sorted.iter().filter(|period| **period > GAP).count();
    let Some(longest) = sorted.last().filter(|_| gaps > 0) else { return Finding::good("gaps", "None.") };
    let missing: f64 =
        sorted.iter().map(|period| (period / DT).round() - 1.0).filter(|missing| *missing > 0.0).sum();
    let share = missing / (missing + rows as f64);
    let verdict = if share > 0.01 || *longest > 1.0 { Verdict::Bad } else { Verdict::Note };
    let percent = 100.0 * share;
    let text = format!("{gaps} with {missing:.0} missing rows ({percent:.2} %), the longest {longest:.2} s.");
    Finding { what: "gaps", verdict, text }
}
