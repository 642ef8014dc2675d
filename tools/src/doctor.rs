//! The doctor examines a recording before its results are trusted: how the sensor behaves, and what the recording can
//! judge.
//!
//! The recording is read row by row and not rejected for its defects: a defect for which other commands would reject
//! the recording is reported as a finding.

mod align;
mod allan;
mod finding;
mod forward;
mod mounting;
mod page;
mod range;
mod recording;
mod reference;
mod sampling;
mod scope;
mod standstill;
mod wheels;

pub use allan::{Allan, Noise};
pub use finding::{Finding, Verdict};
pub use mounting::Mounting;
pub use page::page;

use crate::drive::error::DataError;
use crate::drive::replay::initialise;
use crate::drive::stream::Drive;
use recording::Rows;
use std::path::Path;

/// The results of examining a recording.
#[derive(Debug)]
pub struct Doctor {
    /// The name of the recording.
    pub name: String,
    /// The time from the first row to the last, s.
    pub seconds: f64,
    pub findings: Vec<Finding>,
    /// Begin and end of each standstill, s.
    pub standstills: Vec<(f64, f64)>,
    /// Allan deviations of the gyro about x, y and z in the longest standstill.
    pub allan: Option<[Allan; 3]>,
    /// Noise figures of the gyro about x, y and z.
    pub noise: Option<[Option<Noise>; 3]>,
    /// The mounting, by gravity at rest.
    pub mounting: Option<Mounting>,
    /// Yaw rate of the gyro and of the reference over time, rad/s, for the chart.
    pub curves: [Vec<(f64, f64)>; 2],
}

impl Doctor {
    /// Examines a recording.
    pub fn examine(path: &Path) -> Result<Self, DataError> {
        let mut doctor = Self::of(&Rows::read(path)?);
        doctor.findings.insert(0, start(path));
        Ok(doctor)
    }

    fn of(rows: &Rows) -> Self {
        let standstills = standstill::find(rows);
        let longest = standstills.iter().max_by_key(|span| span.len());
        let allan = allan::at_rest(rows, longest);
        let noise = allan.as_ref().map(|allan| [0, 1, 2].map(|axis: usize| allan[axis].noise()));
        let mounting = longest.and_then(|span| Mounting::at_rest(&rows.force[span.clone()]));

        let mut findings = sampling::findings(rows);
        findings.extend(range::findings(rows));
        findings.extend([
            standstill::finding(rows, &standstills),
            allan::finding(noise.as_ref(), longest),
            Finding::note(
                "temperature",
                "Not examined: a bias that follows temperature cannot be told from one that drifts.",
            ),
            mounting::finding(mounting.as_ref()),
            forward::finding(rows, mounting.as_ref()),
            wheels::finding(rows),
            reference::finding(rows, longest),
            scope::finding(rows, &standstills),
        ]);
        let seconds = |row: usize| rows.seconds[row.min(rows.len() - 1)];
        Self {
            name: rows.name.clone(),
            seconds: rows.seconds.last().copied().unwrap_or_default(),
            standstills: standstills.iter().map(|span| (seconds(span.start), seconds(span.end))).collect(),
            allan,
            noise,
            mounting,
            curves: [rows.series(|k| Some(rows.rate[k][2])), rows.series(|k| rows.reference[k])],
            findings,
        }
    }

    /// Returns the finding about a subject.
    pub fn finding(&self, what: &str) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.what == what)
    }
}

/// Runs the beginning of the drive through the pipeline and reports whether static initialisation succeeds.
fn start(path: &Path) -> Finding {
    let run = || -> Result<(), Box<dyn std::error::Error>> {
        initialise(&Drive::open(path)?)?;
        Ok(())
    };
    match run() {
        Ok(()) => Finding::good("start", "Static initialisation succeeds."),
        Err(reason) => {
            let reason = reason.to_string();
            // The page may be sent to others, so it shows the recording's name instead of a path.
            let reason = reason.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&reason);
            Finding::bad("start", format!("{reason}; `gyronet import --from` skips the beginning."))
        }
    }
}

#[cfg(test)]
mod tests;
