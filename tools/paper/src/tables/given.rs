//! Compares another program's trajectories with our methods: those of a folder, one file for each
//! sequence, named `SEQUENCE.txt`.
//!
//! A trajectory is compared without alignment, so it must be in the truth's frame (that of `global_pose.csv`) and on the clock of the sequence's files. It must
//! cover the sequence from the end of static initialisation, where our methods start, to within [`MISSING_END`] of
//! the end. Poses at the sequence's steps are interpolated. A trajectory that cannot be compared is an error and
//! gives no numbers.

use crate::sequence::Sequence;
use crate::trajectory::{Pose, Trajectory};
use gyronet_tools::drive::DT;
use gyronet_tools::drive::error::{DataError, DataFault};
use gyronet_tools::evaluate::angle::wrap;
use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::trajectory_error::Point;
use std::path::PathBuf;
use std::str::FromStr;

/// A trajectory may end this much before the sequence, s, because some programs write only whole seconds.
pub const MISSING_END: f64 = 1.0;
/// Largest time between two poses, s: a car in a sharp turn (3 m/s^2) then deviates 15 mm from the straight line.
pub const MAX_STEP: f64 = 0.2;
/// Largest distance, m, and angle, rad, of a trajectory from the true pose where our methods start.
pub const START_TOLERANCE: (f64, f64) = (1.0, 0.1);
/// A pose has diverged if its distance from the truth exceeds twice the distance driven plus this, m: no path of the
/// vehicle's length reaches it.
pub const DIVERGED: f64 = 100.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Given {
    /// The method's name in tables and in JSON.
    pub method: Method,
    pub folder: PathBuf,
}

impl FromStr for Given {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once('=').filter(|(name, folder)| !name.is_empty() && !folder.is_empty());
        let (name, folder) = parts.ok_or("expected NAME=FOLDER")?;
        Ok(Self { method: Method::given(name), folder: PathBuf::from(folder) })
    }
}

impl Given {
    /// Returns the turn of each compared step, and the position after it.
    pub fn path(&self, sequence: &Sequence, start: usize) -> Result<(Vec<f64>, Vec<Point>), DataError> {
        let trajectory = Trajectory::read(&self.folder.join(format!("{}.txt", sequence.name)))?;
        compared(&trajectory, sequence, start)
    }
}

/// Returns the turn of each compared step and the position after it, in the frame of the sequence's steps. The first
/// turn begins from the true heading, as for every method.
fn compared(
    trajectory: &Trajectory,
    sequence: &Sequence,
    start: usize,
) -> Result<(Vec<f64>, Vec<Point>), DataError> {
    let refused =
        |line, reason: String| DataError::at(&trajectory.path, line, DataFault::Other(reason.into()));
    let time = |step: usize| sequence.start_s + step as f64 * DT;
    let first = start.saturating_sub(1);
    let end = time(sequence.steps.len().saturating_sub(1)) - MISSING_END;
    let way: f64 = sequence.steps.iter().map(|step| (step.wheels[0] + step.wheels[1]).abs() / 2.0).sum();
    let most = 2.0 * way + DIVERGED;
    let (mut turns, mut places, mut last) = (Vec::new(), Vec::new(), 0.0);
    let mut poses = trajectory.poses.windows(2).peekable();
    for (number, truth) in sequence.steps.iter().enumerate().skip(first) {
        let now = time(number);
        // Skip the poses before this step.
        while poses.next_if(|pair| pair[1].time < now).is_some() {}
        let Some([before, after]) = poses.peek() else { break };
        if before.time > now {
            break;
        }
        let seconds = after.time - before.time;
        if seconds > MAX_STEP {
            let late =
                format!("{seconds:.2} s after the previous pose; at most {MAX_STEP} s can be interpolated");
            return Err(refused(after.line, late));
        }
        let pose = between(before, after, now);
        let place = [0, 1].map(|axis| pose.position[axis] - sequence.origin[axis]);
        let metres = libm::hypot(place[0] - truth.position[0], place[1] - truth.position[1]);
        if number == first {
            let turned = wrap(pose.yaw - truth.yaw);
            if metres > START_TOLERANCE.0 || turned.abs() > START_TOLERANCE.1 {
                let degrees = turned.abs().to_degrees();
                return Err(refused(
                    pose.line,
                    format!(
                        "{metres:.2} m and {degrees:.1} deg from the truth at the start: the frames differ"
                    ),
                ));
            }
            last = pose.yaw - turned;
            continue;
        }
        if metres > most {
            let far = format!(
                "{metres:.0} m from the truth, where at most {most:.0} m are possible: it has diverged"
            );
            return Err(refused(after.line, far));
        }
        turns.push(pose.yaw - std::mem::replace(&mut last, pose.yaw));
        places.push(place);
    }
    let covered = time(first + places.len());
    if places.is_empty() || covered < end {
        let span = |poses: &[Pose]| Some((poses.first()?.time, poses.last()?.time));
        let (from_s, to_s) = span(&trajectory.poses).unwrap_or_default();
        let reason = format!(
            "has poses from {from_s:.2} to {to_s:.2} s, but {:.2} to {end:.2} s are needed: wrong length or clock",
            time(first)
        );
        return Err(DataError::because(&trajectory.path, reason));
    }
    Ok((turns, places))
}

/// Returns the pose at a time, interpolated linearly between two poses.
fn between(before: &Pose, after: &Pose, time: f64) -> Pose {
    let part = (time - before.time) / (after.time - before.time);
    let on = |from: f64, to: f64| from + (to - from) * part;
    let position = [0, 1].map(|axis| on(before.position[axis], after.position[axis]));
    Pose { line: before.line, time, position, yaw: on(before.yaw, after.yaw) }
}
