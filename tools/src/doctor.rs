//! A recording is examined before anyone trusts it: what its sensor does, what can be judged on it, and what a calibration
//! or a training could gain.
//!
//! The recording is read row by row and refused by nobody here: what the other commands would refuse it for is one of the
//! findings.

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
use crate::drive::recording::Recording;
use crate::drive::replay::Replay;
use crate::evaluate::ablation::Uncorrected;
use gyronet::pipeline::PipelineConfig;
use recording::Rows;
use std::path::Path;

/// Rows in which static initialisation is over.
const STARTED: usize = 400;

/// Holds a recording examined.
#[derive(Debug)]
pub struct Doctor {
    /// Its name.
    pub name: String,
    /// The time from the first row to the last, s.
    pub seconds: f64,
    /// The findings.
    pub findings: Vec<Finding>,
    /// The standstills: from and to, s.
    pub standstills: Vec<(f64, f64)>,
    /// Allan deviations of the gyro about x, y and z in the longest standstill.
    pub allan: Option<[Allan; 3]>,
    /// Their figures.
    pub noise: Option<[Option<Noise>; 3]>,
    /// The mounting.
    pub mounting: Option<Mounting>,
    /// The yaw rate over time, rad/s, for the picture: the gyro's and the reference's.
    pub curves: [Vec<(f64, f64)>; 2],
}

impl Doctor {
    /// Examines a recording.
    ///
    /// # Errors
    /// [`DataError`]: the file is no drive at all.
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
                "Not a column of a drive: a bias that follows temperature cannot be told from one that drifts.",
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

    /// Returns the finding on a subject.
    #[must_use]
    pub fn finding(&self, what: &str) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.what == what)
    }
}

/// Runs the beginning of the drive through the pipeline, which says itself whether it can start.
fn start(path: &Path) -> Finding {
    let run = || -> Result<(), Box<dyn std::error::Error>> {
        let mut recording = Recording::read(path)?;
        recording.rows.truncate(STARTED);
        Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Uncorrected, || {})?;
        Ok(())
    };
    match run() {
        Ok(()) => Finding::good("start", "Static initialisation succeeds."),
        Err(reason) => {
            let reason = reason.to_string();
            // The page has its own name, and may be sent to others.
            let reason = reason.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&reason);
            Finding::bad("start", format!("{reason}; `gyronet import --from` leaves out a beginning."))
        }
    }
}

#[cfg(test)]
mod tests;
