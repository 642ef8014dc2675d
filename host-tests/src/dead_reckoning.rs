//! This module does dead reckoning of a simulated sequence with turns from any source.

use gyronet::odometry::Track;
use gyronet_tools::evaluate::trajectory_error::TrajectoryError;
use gyronet_tools::paper::sequence::Sequence;

/// Returns the root mean square distance from the true path of dead reckoning with these turns, m.
///
/// # Panics
/// When the sequence has no step, or there are fewer turns than steps.
#[must_use]
pub fn error(sequence: &Sequence, turns: impl Iterator<Item = f64>) -> f64 {
    let yaw = sequence.steps.first().expect("it has steps").yaw;
    let mut track = Track { yaw, ..Track::default() };
    let walked = sequence.steps.iter().zip(turns).map(|(step, turn)| {
        track.step(step.wheels, turn);
        track.position
    });
    let truth: Vec<_> = sequence.steps.iter().map(|step| step.position).collect();
    TrajectoryError::new(&walked.collect::<Vec<_>>(), &truth).expect("as many of both").rmse_m
}
