//! Reads trajectories in the format of TUM's RGB-D benchmark, as evo reads and writes them. A row is
//! `time x y z qx qy qz qw`, separated by spaces: time in s since 1970, ascending, position in m, and attitude as a
//! quaternion. Rows that begin with # are comments.

use super::sequence::{columns, yaw};
use gyronet_tools::drive::error::{DataError, DataFault, ValueError, read_text};
use gyronet_tools::evaluate::angle::wrap;
use gyronet_tools::evaluate::trajectory_error::Point;
use std::path::Path;

const COLUMNS: [&str; 8] = ["time", "x", "y", "z", "qx", "qy", "qz", "qw"];
/// A value beyond this is refused: UTM coordinates are about 4e6 m, times since 1970 about 2e9 s.
const MAX_VALUE: f64 = 1e12;
/// Tolerance of a quaternion's norm, which differs from 1 by the rounding of the printed digits.
const NORM_TOLERANCE: f64 = 0.01;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    pub line: u64,
    /// The time, s since 1970.
    pub time: f64,
    /// The file's x and y, usually east and north, m.
    pub position: Point,
    /// Heading, not wrapped, rad.
    pub yaw: f64,
}

/// Holds the trajectory of a file: at least one pose, times ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    pub path: String,
    pub poses: Vec<Pose>,
}

impl Trajectory {
    pub fn read(path: &Path) -> Result<Self, DataError> {
        Self::parse(path.display().to_string(), &read_text(path)?)
    }

    pub fn parse(path: String, text: &str) -> Result<Self, DataError> {
        let mut poses: Vec<Pose> = Vec::new();
        for (line, row) in (1..).zip(text.lines()) {
            let row = row.trim();
            if row.is_empty() || row.starts_with('#') {
                continue;
            }
            poses.push(pose(&path, line, row, poses.last())?);
        }
        if poses.is_empty() { Err(DataError::of(&path, DataFault::Empty)) } else { Ok(Self { path, poses }) }
    }
}

fn pose(path: &str, line: u64, row: &str, last: Option<&Pose>) -> Result<Pose, DataError> {
    let fault = |fault| DataError::at(path, line, fault);
    let fields: Vec<&str> = row.split_whitespace().collect();
    let other = |reason: String| fault(DataFault::Other(reason.into()));
    let columns = || other(columns(fields.len(), COLUMNS.len()));
    let fields: [&str; COLUMNS.len()] = fields.as_slice().try_into().map_err(|_| columns())?;
    let mut values = [0.0; COLUMNS.len()];
    for ((value, text), column) in values.iter_mut().zip(fields).zip(COLUMNS) {
        *value = number(text).map_err(|error| DataError::value(path, line, column, text, error))?;
    }
    let [time, x, y, _, qx, qy, qz, qw] = values;
    let norm = libm::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(other(format!("a quaternion of norm {norm:.3}, which is no attitude")));
    }
    if let Some(last) = last.filter(|last| time <= last.time) {
        return Err(fault(DataFault::Time { last_s: last.time, at_s: time }));
    }
    let heading = yaw([qx, qy, qz, qw].map(|q| q / norm));
    let yaw = last.map_or(heading, |last| last.yaw + wrap(heading - last.yaw));
    Ok(Pose { line, time, position: [x, y], yaw })
}

fn number(text: &str) -> Result<f64, ValueError> {
    let value: f64 = text.parse().map_err(|_| ValueError::NotANumber)?;
    if !value.is_finite() {
        return Err(ValueError::NotFinite);
    }
    if value.abs() > MAX_VALUE { Err(ValueError::OutOfRange) } else { Ok(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str =
        "# time x y z qx qy qz qw\n\n1.5 355000.25 -2 60 0 0 0.8 0.6\n1.51 1 2 3 0 0 -0.8 0.6\n";

    fn error(row: &str) -> String {
        Trajectory::parse("a.txt".into(), &format!("{GOOD}{row}\n")).unwrap_err().to_string()
    }

    #[test]
    fn poses_lie_in_the_plane_and_headings_go_on() {
        let parsed = Trajectory::parse("a.txt".into(), GOOD).unwrap();
        let [first, second] = parsed.poses[..] else { panic!("{parsed:?}") };
        assert_eq!((first.line, first.time, first.position), (3, 1.5, [355_000.25, -2.0]));
        let half = libm::atan2(0.8, 0.6);
        assert!((first.yaw - 2.0 * half).abs() < 1e-12, "{first:?}");
        assert!(
            (second.yaw - (std::f64::consts::TAU - 2.0 * half)).abs() < 1e-12,
            "the short way: {second:?}"
        );
    }

    #[test]
    fn a_bad_row_is_named() {
        for (row, expected) in [
            ("1.52 1 2 3 0 0 0", "a.txt: line 5: 7 columns, expected 8"),
            ("1.52,1,2,3,0,0,0,1", "a.txt: line 5: 1 columns, expected 8"),
            ("1.52 1 nan 3 0 0 0 1", "a.txt: line 5, column y: \"nan\" is not finite"),
            ("1.52 1e13 2 3 0 0 0 1", "a.txt: line 5, column x: \"1e13\" is out of range"),
            ("1.52 1 2 3 0 0 0 one", "a.txt: line 5, column qw: \"one\" is not a number"),
            ("1.52 1 2 3 0 0 0 0", "a.txt: line 5: a quaternion of norm 0.000, which is no attitude"),
            ("1.5 1 2 3 0 0 0 1", "a.txt: line 5: time goes backwards from 1.5100 s to 1.5000 s"),
            ("1.51 1 2 3 0 0 0 1", "a.txt: line 5: time goes nowhere from 1.5100 s to 1.5100 s"),
        ] {
            assert_eq!(error(row), expected);
        }
        let nothing = Trajectory::parse("a.txt".into(), "# nothing\n").unwrap_err().to_string();
        assert_eq!(nothing, "a.txt: holds no samples");
    }
}
