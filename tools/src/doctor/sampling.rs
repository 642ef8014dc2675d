//! Examines the sample rate, the gaps, and the rows that cannot be read.

use super::finding::{Finding, Verdict};
use super::recording::{Rows, sorted};
use super::remedy;
use crate::drive::DT;
use gyronet::align::PERIODS_US;
use std::ops::RangeInclusive;

/// A longer period than this is a gap, s.
const GAP: f64 = 0.015;
const IMPORTED_HZ: RangeInclusive<f64> = 24.9..=1_001.0;
/// Sources whose rate the results depend on.
const RESAMPLED: [&str; 4] = ["imu", "gyro", "accelerometer", "reference rate"];

pub fn findings(rows: &Rows) -> Vec<Finding> {
    let mut findings = Vec::new();
    let periods = sorted(rows.seconds.windows(2).map(|pair| pair[1] - pair[0]));
    match rows.period {
        None => findings.push(Finding::bad("rate", "Fewer than two rows can be read.")),
        Some(median) => {
            let is_used = PERIODS_US.contains(&((1e6 * median).round() as u64));
            let text = format!("{:.2} Hz by the median period", 1.0 / median);
            if !is_used {
                let is_in =
                    |per_second: f64| PERIODS_US.contains(&((1e6 * median / per_second).round() as u64));
                let unit = [(1e3, "ms"), (1e6, "us"), (1e9, "ns")].into_iter().find(|(per, _)| is_in(*per));
                let resample = || {
                    if IMPORTED_HZ.contains(&(1.0 / median)) {
                        remedy::command(rows, "", "100hz") + " makes 100 Hz of 25 to 1000 Hz"
                    } else {
                        "record it again at such a rate".to_owned()
                    }
                };
                let cure = unit.map_or_else(resample, |(_, unit)| remedy::unit(rows, "t_s", unit));
                let text = format!("{text}: the board and the other commands use 50 to 1000 Hz; {cure}.");
                findings.push(Finding::bad("rate", text));
            } else {
                let brought =
                    if (median - DT).abs() < 1e-6 { "" } else { ", brought to 100 Hz as on the board" };
                findings.push(Finding::good("rate", format!("{text}{brought}.")));
                findings.push(gaps(&periods, rows.len()));
            }
        }
    }
    let is_slow = |hz: f64| hz > 0.0 && 1e6 / hz > *PERIODS_US.end() as f64;
    let rates = rows.vehicle.recording.rates.iter();
    let slow = rates.filter(|(role, hz)| RESAMPLED.contains(&role.as_str()) && is_slow(**hz));
    let slow: Vec<String> = slow.map(|(role, hz)| format!("{role} {hz} Hz")).collect();
    if !slow.is_empty() {
        let slow = slow.join(", ");
        let text =
            format!("{slow}: `import` has interpolated the rows between; the board uses 50 to 1000 Hz.");
        findings.push(Finding::note("source rate", text));
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
