//! Computes the errors of every method on every sequence, and their means, for the tables and the JSON.

use super::estimates::{Estimate, Estimates, Places};
use crate::sequence::Sequence;
use gyronet_tools::drive::DT;
use gyronet_tools::drive::track::Track;
use gyronet_tools::evaluate::angle::wrap;
use gyronet_tools::evaluate::heading_error::AgainstRate;
use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::trajectory_error::{Point, TrajectoryError};
use serde::Serialize;
use std::collections::BTreeMap;

/// A group of sequences that are averaged together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// The paper's first sequences, and simulated ones of the first device.
    First,
    /// Urban18 and later, which the paper calls newly released. No source says that their sensors differ.
    NewlyReleased,
    /// Simulated sequences of other devices.
    OtherDevices,
}

impl Group {
    pub fn of(sequence: &Sequence) -> Self {
        if let Some(spec) = &sequence.simulated {
            return if spec.device == 1 { Self::First } else { Self::OtherDevices };
        }
        let number = sequence.name.trim_start_matches(|c: char| !c.is_ascii_digit());
        let is_new = number.parse().is_ok_and(|number: u32| number >= 18);
        if is_new { Self::NewlyReleased } else { Self::First }
    }
}

/// Holds the errors of a method on a sequence, or the mean over several.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Mean error of the yaw change in 1 s, rad.
    pub mean_1s_rad: f64,
    /// Error of the final yaw, wrapped, rad.
    pub final_rad: f64,
    /// Error of the final yaw, not wrapped, rad.
    pub final_unwrapped_rad: f64,
    /// Absolute trajectory error with odometry, RMS, m.
    pub ate_m: f64,
    /// Mean distance from the true path with odometry, m.
    pub ate_mean_m: f64,
    /// Absolute trajectory error after alignment, RMS, m.
    pub aligned_ate_m: f64,
    /// Mean distance from the true path after alignment, m.
    pub aligned_ate_mean_m: f64,
}

pub type ByMethod = BTreeMap<&'static str, Errors>;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequenceErrors {
    pub name: String,
    pub simulated: bool,
    pub group: Group,
    /// Length of the compared part, s.
    pub seconds: f64,
    /// Distance measured by the wheels, m.
    pub metres: f64,
    /// The reason why some methods could not be run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    pub methods: ByMethod,
    /// The reasons why given trajectories could not be compared, by the key of the method.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub left_out: BTreeMap<&'static str, String>,
    /// Text with the fitted numbers of wheels and fibre-optic gyro, and the sequences they were fitted to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted: Option<String>,
    #[serde(skip)]
    pub order: Vec<Method>,
}

impl SequenceErrors {
    pub fn new(sequence: &Sequence, estimates: &Estimates) -> Self {
        let steps = &sequence.steps[estimates.start..];
        let turns = &sequence.turns()[estimates.start..];
        let truth: Vec<Point> = steps.iter().map(|step| step.position).collect();
        // The heading before the first compared turn.
        let heading = steps.first().map_or(0.0, |step| step.yaw) - turns.first().copied().unwrap_or(0.0);
        let begin = estimates.start.checked_sub(1).map_or([0.0; 2], |k| sequence.steps[k].position);
        let (mut methods, mut order) = (ByMethod::new(), Vec::new());
        for estimate in &estimates.methods {
            let scale = if let Places::Reckoned { scale } = estimate.places { scale } else { 1.0 };
            let mut track = Track { position: begin, yaw: heading };
            let reckoned = steps.iter().zip(&estimate.turns).map(|(step, turned)| {
                track.step(step.wheels.map(|way| scale * way), *turned);
                track.position
            });
            let points: Vec<Point> = match &estimate.places {
                Places::Given(places) => places.clone(),
                Places::Reckoned { .. } => reckoned.collect(),
            };
            if let Some(errors) = Errors::new(turns, estimate, &points, &truth) {
                methods.insert(estimate.method.key, errors);
                order.push(estimate.method);
            }
        }
        Self {
            name: sequence.name.clone(),
            simulated: sequence.simulated.is_some(),
            group: Group::of(sequence),
            seconds: steps.len() as f64 * DT,
            metres: steps.iter().map(|step| (step.wheels[0] + step.wheels[1]).abs() / 2.0).sum(),
            refused: estimates.refused.clone(),
            left_out: estimates.left_out.iter().map(|(method, why)| (method.key, why.clone())).collect(),
            fitted: estimates.fitted.clone(),
            methods,
            order,
        }
    }
}

impl Errors {
    fn new(turns: &[f64], estimate: &Estimate, points: &[Point], truth: &[Point]) -> Option<Self> {
        // A given trajectory may end before the sequence.
        let (turns, truth) = (turns.get(..points.len())?, truth.get(..points.len())?);
        let mut yaw = AgainstRate::default();
        estimate.turns.iter().zip(turns).for_each(|(turn, truth)| yaw.add(turn / DT, truth / DT));
        let yaw = yaw.errors()?.figures;
        let final_rad = yaw.final_rad?;
        let ate = TrajectoryError::new(points, truth)?;
        let aligned = TrajectoryError::aligned(points, truth)?;
        Some(Self {
            mean_1s_rad: yaw.mean_1s_rad?,
            final_rad: wrap(final_rad).abs(),
            final_unwrapped_rad: final_rad,
            ate_m: ate.rmse_m,
            ate_mean_m: ate.mean_m,
            aligned_ate_m: aligned.rmse_m,
            aligned_ate_mean_m: aligned.mean_m,
        })
    }

    fn mean(errors: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
        Self {
            mean_1s_rad: mean(|e| e.mean_1s_rad),
            final_rad: mean(|e| e.final_rad),
            final_unwrapped_rad: mean(|e| e.final_unwrapped_rad),
            ate_m: mean(|e| e.ate_m),
            ate_mean_m: mean(|e| e.ate_mean_m),
            aligned_ate_m: mean(|e| e.aligned_ate_m),
            aligned_ate_mean_m: mean(|e| e.aligned_ate_mean_m),
        }
    }
}

pub fn mean<'a>(sequences: impl Iterator<Item = &'a SequenceErrors>) -> ByMethod {
    let mut all: BTreeMap<&'static str, Vec<Errors>> = BTreeMap::new();
    let mut count = 0;
    for sequence in sequences {
        count += 1;
        for (key, errors) in &sequence.methods {
            all.entry(key).or_default().push(*errors);
        }
    }
    // Means over different numbers of sequences cannot be compared.
    all.into_iter().filter(|(_, e)| e.len() == count).map(|(key, e)| (key, Errors::mean(&e))).collect()
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Results {
    pub simulated: bool,
    pub sequences: Vec<SequenceErrors>,
    /// The means over all sequences, for the methods that were run on all of them.
    pub mean: ByMethod,
    /// GyroNet's mean error in 1 s relative to that of static initialisation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gyronet_to_static: Option<f64>,
    /// The same ratio in the paper's Table I.
    pub gyronet_to_static_paper: f64,
}

impl Results {
    pub fn new(sequences: Vec<SequenceErrors>) -> Self {
        let mean_all = mean(sequences.iter());
        let error = |key: &str| mean_all.get(key).map(|errors| errors.mean_1s_rad);
        let gyronet_to_static = error("gyronet").zip(error("static")).map(|(network, still)| network / still);
        Self {
            simulated: sequences.iter().any(|sequence| sequence.simulated),
            mean: mean_all,
            gyronet_to_static,
            gyronet_to_static_paper: super::paper::GYRONET_TO_STATIC,
            sequences,
        }
    }
}
