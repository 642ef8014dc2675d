//! The doctor examines a recording before its results are trusted: how the sensor behaves, and what the recording can
//! judge.
//!
//! The recording is read row by row and not rejected for its defects: a defect for which other commands would reject
//! the recording is reported as a finding.

mod align;
mod allan;
mod finding;
mod forward;
mod line;
mod mounting;
mod range;
mod recording;
mod reference;
mod remedy;
mod sampling;
mod scope;
mod speed;
mod standstill;
mod wheels;

pub use allan::Noise;
pub use finding::{Finding, Verdict};
pub use mounting::Mounting;

use crate::drive::error::DataError;
use crate::drive::foreign;
use crate::drive::recording::Reader;
use crate::drive::replay::initialise;
use crate::drive::stream::{Drive, Recording};
use crate::drive::vehicle::Vehicle;
use recording::Rows;
use std::path::Path;

/// Shortest standstill in which a drive can start, and what is worth a start after it, s.
const LEAST_REST_S: f64 = 4.0;
const LEAST_DRIVE_S: f64 = 60.0;

#[derive(Debug)]
pub struct Doctor {
    pub name: String,
    /// The time from the first row to the last, s.
    pub seconds: f64,
    pub findings: Vec<Finding>,
    /// Begin and end of each standstill, s.
    pub standstills: Vec<(f64, f64)>,
    /// Noise figures of the gyro about x, y and z, in the longest standstill.
    pub noise: Option<[Option<Noise>; 3]>,
    /// The mounting, by gravity at rest.
    pub mounting: Option<Mounting>,
}

impl Doctor {
    pub fn examine(path: &Path) -> Result<Self, DataError> {
        let rows = Rows::read(path)?;
        let mut doctor = Self::of(&rows);
        doctor.findings.insert(0, start(path, &doctor, &rows)?);
        Ok(doctor)
    }

    fn of(rows: &Rows) -> Self {
        let (standstills, driven) = standstill::find(rows);
        let longest = standstills.iter().max_by_key(|span| span.len());
        let noise = allan::at_rest(rows, longest);
        let mounting = longest.and_then(|span| Mounting::at_rest(&rows.force[span.clone()]));

        let forward = forward::find(rows, mounting.as_ref());
        let mut findings = sampling::findings(rows);
        findings.extend(range::findings(rows));
        findings.extend([
            standstill::finding(rows, (&standstills, driven)),
            allan::finding(noise.as_ref(), longest),
            Finding::note(
                "temperature",
                "Not examined: a bias that follows temperature cannot be told from one that drifts.",
            ),
            mounting::finding(rows, mounting.as_ref(), forward::wrong(forward)),
            forward::finding(rows, mounting.as_ref(), forward),
            wheels::finding(rows),
            reference::finding(rows, longest),
            scope::finding(rows, &standstills),
        ]);
        findings.extend(speed::finding(rows));
        let seconds = |row: usize| rows.seconds[row.min(rows.len() - 1)];
        Self {
            name: rows.name.clone(),
            seconds: rows.seconds.last().copied().unwrap_or_default(),
            standstills: standstills.iter().map(|span| (seconds(span.start), seconds(span.end))).collect(),
            noise,
            mounting,
            findings,
        }
    }

    pub fn finding(&self, what: &str) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.what == what)
    }
}

/// Runs the beginning of the drive through the pipeline and reports whether static initialisation succeeds, or else
/// from when on it does.
fn start(path: &Path, doctor: &Doctor, rows: &Rows) -> Result<Finding, DataError> {
    let run = || -> Result<(), Box<dyn std::error::Error>> {
        initialise(&Drive::open(path)?)?;
        Ok(())
    };
    let Err(reason) = run() else { return Ok(Finding::good("start", "Static initialisation succeeds.")) };
    let reason = reason.to_string();
    // A finding may be sent to others, so it shows the recording's name instead of a path.
    let reason = reason.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&reason);
    let reason = reason.split_once("; `gyronet doctor`").map_or(reason, |(reason, _)| reason);
    let is_first = |finding: &&Finding| {
        finding.verdict == Verdict::Bad && (finding.what == "rate" || finding.text.contains("--unit "))
    };
    if let Some(first) = doctor.findings.iter().find(is_first) {
        let what = if first.what == "rate" { "rate" } else { "unit" };
        return Ok(Finding::bad("start", format!("{reason}; first mend the {what}, below.")));
    }
    let mut from = None;
    let is_enough =
        |(begin, end): &&(f64, f64)| end - begin >= LEAST_REST_S && doctor.seconds - end >= LEAST_DRIVE_S;
    for (begin, end) in doctor.standstills.iter().filter(is_enough) {
        if starts(path, *begin, *end)? {
            from = Some(begin.ceil());
            break;
        }
    }
    let remedy = match from {
        Some(from) => format!(
            "it can start at {from} s: {}",
            remedy::command(rows, &format!("--from {from}"), &format!("from_{from}"))
        ),
        None => {
            "no later rest of 3 s has a minute of driving after it: record it again, and let it stand for the first 3 s; \
             `evaluate` simulates them where a course is known (ref_yaw)".to_owned()
        }
    };
    Ok(Finding::bad("start", format!("{reason}; {remedy}.")))
}

/// Returns whether static initialisation succeeds between two times, s since the first row.
fn starts(path: &Path, begin: f64, end: f64) -> Result<bool, DataError> {
    let vehicle = Vehicle::of_drive(path)?;
    let name = path.display().to_string();
    let (mut first, mut rows) = (None, Vec::new());
    for row in Reader::new(&name, foreign::open(path)?)?.mounted(&vehicle) {
        let Ok(row) = row else { continue };
        let time = 1e-6 * (row.sample.time.0 - *first.get_or_insert(row.sample.time.0)) as f64;
        if time > end {
            break;
        }
        if time >= begin.ceil() {
            rows.push(row);
        }
    }
    let part = Recording { path: name, rows, missing: 0, vehicle };
    Ok(initialise(&Drive::from(&part)).is_ok())
}

#[cfg(test)]
mod tests;
