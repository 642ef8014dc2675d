//! Samples through a pipeline with a network of the test's own.

use crate::synthetic::{rate, turning};
use gyronet::health::{Faults, Status};
use gyronet::model::Estimate;
use gyronet::model::window::WINDOW;
use gyronet::pipeline::{BoardState, DueWindow, Output, Pipeline, PipelineConfig};
use gyronet::sample::ImuSample;

/// First tick after static initialisation, if nothing disturbs it.
pub const KNOWN: u64 = 300;

pub fn new() -> Pipeline {
    Pipeline::new(PipelineConfig::DEFAULT)
}

/// A vehicle that stands and turns from tick [`KNOWN`] on.
pub fn drive(ticks: impl IntoIterator<Item = u64>) -> impl Iterator<Item = ImuSample> {
    ticks.into_iter().map(|tick| turning(tick, rate(if tick < KNOWN { 0.001 } else { 0.25 })))
}

/// A network whose corrections are always the same, rad/s.
pub fn constant(correction: f64) -> impl FnMut(&DueWindow) -> Option<Estimate> {
    move |_| Some(Estimate { corrections: [rate(correction); WINDOW], ..Estimate::NONE })
}

/// Estimates are delivered at once, and for `None` nothing is delivered.
pub fn run(
    pipeline: &mut Pipeline,
    samples: impl IntoIterator<Item = ImuSample>,
    mut network: impl FnMut(&DueWindow) -> Option<Estimate>,
) -> Vec<Output> {
    let mut outputs = Vec::new();
    for sample in samples {
        let output = pipeline.correct(sample, None, &BoardState::GOOD).expect("the sample is on the grid");
        if let Some(due) = &output.window
            && let Some(estimate) = network(due)
        {
            pipeline.deliver(due.end, estimate);
        }
        outputs.push(output);
    }
    outputs
}

/// The runs of equal status of the live rate: each with its number of samples.
pub fn statuses(outputs: &[Output]) -> Vec<(Status, usize)> {
    outputs
        .chunk_by(|a, b| a.vehicle.live.status == b.vehicle.live.status)
        .map(|run| (run[0].vehicle.live.status, run.len()))
        .collect()
}

pub fn faults(outputs: &[Output]) -> Vec<(Faults, usize)> {
    let faults = |output: &Output| output.vehicle.delayed.faults;
    outputs.chunk_by(|a, b| faults(a) == faults(b)).map(|run| (faults(&run[0]), run.len())).collect()
}
