//! The yaw errors of each method, drive by drive, as a table and as JSON.

use crate::drive::recording::Recording;
use crate::evaluate::methods::{Method, PerMethod, Rates};
use crate::evaluate::metrics::{WINDOW, YawError};
use gyronet::sample::RATE_HZ;
use serde::Serialize;
use std::fmt;

/// The error of a drive that cannot be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// There is no truth to compare with.
    #[error("{path}: line {line}: no reference yaw rate (column ref_gyr_z), which evaluation needs")]
    NoReference {
        /// The recording.
        path: String,
        /// The first line without it.
        line: u64,
    },
    /// Less than a second is left after static initialisation.
    #[error("{path}: {seconds:.2} s are left after static initialisation, evaluation needs 1 s")]
    TooShort {
        /// The recording.
        path: String,
        /// The time that is left.
        seconds: f64,
    },
}

/// Errors of all methods on one drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriveErrors {
    /// The recording's name.
    pub name: String,
    /// The length of the comparison, s.
    pub seconds: f64,
    /// Grid steps without a sample; they count for no method.
    pub missing: u32,
    /// The errors.
    pub methods: PerMethod<YawError>,
}

impl DriveErrors {
    /// Compares a drive's rates with its reference.
    ///
    /// # Errors
    /// [`EvaluateError`], which names the file.
    pub fn new(recording: &Recording, rates: &Rates) -> Result<Self, EvaluateError> {
        let path = || recording.path.clone();
        let Some(reference) = &rates.reference else {
            let mut rows = rates.drive.steps[rates.drive.compared()].iter().map(|s| &recording.rows[s.row]);
            let line = rows.find(|row| row.reference.is_none()).map_or(1, |row| row.line);
            return Err(EvaluateError::NoReference { path: path(), line });
        };
        let seconds = reference.len() as f64 / f64::from(RATE_HZ);
        if reference.len() < WINDOW {
            return Err(EvaluateError::TooShort { path: path(), seconds });
        }
        let methods = rates.rates.map(|rate| YawError::new(rate, reference)).all();
        let methods = methods.ok_or_else(|| EvaluateError::TooShort { path: path(), seconds })?;
        let missing = rates.drive.counters.missing;
        Ok(Self { name: recording.name().to_owned(), seconds, missing, methods })
    }
}

/// Errors on several drives and their mean.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// One for each drive.
    pub drives: Vec<DriveErrors>,
    /// The mean of the drives, each counting the same; absent without drives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<PerMethod<YawError>>,
}

impl Report {
    /// Adds the mean.
    #[must_use]
    pub fn new(drives: Vec<DriveErrors>) -> Self {
        let of_method =
            |method| YawError::mean(&drives.iter().map(|drive| drive.methods[method]).collect::<Vec<_>>());
        let mean = PerMethod::new(of_method).all();
        Self { drives, mean }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for drive in &self.drives {
            write!(f, "{}: {:.1} s after static initialisation", drive.name, drive.seconds)?;
            if drive.missing > 0 {
                write!(f, ", {} samples missing", drive.missing)?;
            }
            writeln!(f)?;
            table(f, &drive.methods)?;
            writeln!(f)?;
        }
        if let (Some(mean), [_, _, ..]) = (&self.mean, self.drives.as_slice()) {
            writeln!(f, "mean of {} drives", self.drives.len())?;
            table(f, mean)?;
            writeln!(f)?;
        }
        Ok(())
    }
}

fn table(f: &mut fmt::Formatter<'_>, errors: &PerMethod<YawError>) -> fmt::Result {
    writeln!(f, "  {:<24}{:>14}{:>16}{:>14}", "yaw error", "in 1 s, rad", "to static init", "final, rad")?;
    let baseline = errors[Method::STATIC].mean_1s_rad;
    for (method, error) in errors.each() {
        let ratio = error.mean_1s_rad / baseline;
        let name = method.name;
        writeln!(f, "  {name:<24}{:>14.6}{ratio:>16.3}{:>14.6}", error.mean_1s_rad, error.final_rad)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(drives: usize) -> Report {
        let error = |x| YawError { mean_1s_rad: x, final_rad: 2.0 * x, final_unwrapped_rad: 2.0 * x };
        let methods = |scale: f64| {
            PerMethod::new(|method| {
                error(match method {
                    Method::RAW => scale,
                    Method::STATIC => 0.5 * scale,
                    Method::FIR => 2.0 * scale,
                    Method::GYRONET_F32 => 0.25 * scale,
                    Method::GYRONET_INT => 0.125 * scale,
                    _ => 0.0625 * scale,
                })
            })
        };
        let drive = |k| DriveErrors {
            name: format!("drive{k}"),
            seconds: 10.0,
            missing: 0,
            methods: methods((k + 1) as f64),
        };
        Report::new((0..drives).map(drive).collect())
    }

    #[test]
    fn json_has_the_documented_shape() {
        let json = serde_json::to_value(report(2)).unwrap();
        assert_eq!(json["drives"][0]["name"], "drive0");
        for (method, value) in
            [("raw", 1.5), ("static", 0.75), ("fir", 3.0), ("gyronet_f32", 0.375), ("default", 0.09375)]
        {
            assert!(json["drives"][1]["methods"][method]["mean_1s_rad"].is_f64());
            assert!(json["drives"][1]["methods"][method]["final_rad"].is_f64());
            assert_eq!(json["mean"][method]["mean_1s_rad"], value);
            assert_eq!(json["mean"][method]["final_rad"], 2.0 * value);
        }
    }

    #[test]
    fn table_is_aligned() {
        let text = report(2).to_string();
        let widths: Vec<usize> = text.lines().filter(|line| line.starts_with("  ")).map(str::len).collect();
        assert_eq!(widths.len(), 39);
        assert!(widths.iter().all(|width| *width == widths[0]), "{text}");
        assert!(text.contains("mean of 2 drives"));
        assert!(!report(1).to_string().contains("mean of"));
    }
}
