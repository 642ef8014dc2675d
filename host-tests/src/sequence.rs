//! Simulated sequences, and dead reckoning of them with turns from any source.

use gyronet_paper::sequence::Sequence;
use gyronet_paper::simulate::{self, Spec};
use gyronet_tools::drive::track::Track;
use gyronet_tools::evaluate::trajectory_error::TrajectoryError;
use tempfile::tempdir;

/// Simulated, written and read back.
pub fn simulate(spec: &Spec) -> Sequence {
    let parent = tempdir().expect("there is room");
    let folder = parent.path().join(&spec.name);
    simulate::write(spec, &folder).expect("there is room");
    Sequence::read(&folder).expect("it has just been written")
}

/// The root mean square distance from the true path of dead reckoning with these turns, m.
pub fn path_error(sequence: &Sequence, turns: impl Iterator<Item = f64>) -> f64 {
    let yaw = sequence.steps.first().expect("it has steps").yaw;
    let mut track = Track { yaw, ..Track::default() };
    let walked = sequence.steps.iter().zip(turns).map(|(step, turn)| {
        track.step(step.wheels, turn);
        track.position
    });
    let truth: Vec<_> = sequence.steps.iter().map(|step| step.position).collect();
    TrajectoryError::new(&walked.collect::<Vec<_>>(), &truth).expect("as many of both").rmse_m
}
