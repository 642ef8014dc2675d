//! The error of the delayed rate with different configurations of the pipeline, all of which the board can run.

use crate::board::{Board, Step, Uncorrected};
use crate::drive::replay::{ReplayError, Steps};
use crate::drive::stream::Drive;
use crate::evaluate::metrics::{YawError, YawSums};
use crate::evaluate::rates::{silent, with_lag};
use gyronet::compensate::Lag;
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use serde::Serialize;

#[derive(Debug, Clone)]
pub struct Variant {
    pub name: String,
    pub config: PipelineConfig,
    /// True if the network runs; otherwise the corrections are zero.
    pub network: bool,
}

/// Returns the default configuration at every lag.
pub fn lags() -> Vec<Variant> {
    (0..)
        .map_while(Lag::new)
        .map(|lag| {
            let config = with_lag(PipelineConfig::DEFAULT, lag);
            Variant { name: format!("lag {} ms", 10 * lag.samples()), config, network: true }
        })
        .collect()
}

/// The score of one variant, on one drive or as a mean over drives.
#[derive(Debug, Clone, Serialize)]
pub struct Score {
    pub name: String,
    #[serde(flatten)]
    pub error: YawError,
    /// RMS error of a sample, rad/s.
    pub rms_rad_per_s: f64,
}

/// Runs the variants on one drive, one after the other; `tick` is called for each step of each run. Returns no score if
/// a compared sample has no reference.
pub fn run(
    drive: &Drive<'_>,
    network: &mut impl WindowNetwork,
    variants: &[Variant],
    mut tick: impl FnMut(),
) -> Result<Vec<Score>, ReplayError> {
    let mut scores = Vec::new();
    for Variant { name, config, network: with_network } in variants {
        let network: &mut dyn WindowNetwork = if *with_network { network } else { &mut Uncorrected };
        let mut sums = Sums::default();
        for step in Steps::new(drive, Board::new(silent(*config), drive.wheels(), network))? {
            tick();
            sums.add(&step?);
        }
        scores.extend(sums.score(name));
    }
    Ok(scores)
}

/// Returns the means over drives with equal weights; `None` without drives.
pub fn mean(drives: &[Vec<Score>]) -> Option<Vec<Score>> {
    let first = drives.first()?;
    let count = drives.len() as f64;
    let of = |k: usize| {
        let scores: Vec<&Score> = drives.iter().filter_map(|drive| drive.get(k)).collect();
        let mean =
            |value: &dyn Fn(&Score) -> f64| scores.iter().map(|score| value(score)).sum::<f64>() / count;
        Some(Score {
            name: first[k].name.clone(),
            error: YawError::mean(&scores.iter().map(|score| score.error).collect::<Vec<_>>())?,
            rms_rad_per_s: mean(&|score| score.rms_rad_per_s),
        })
    };
    (0..first.len()).map(of).collect()
}

#[derive(Default)]
struct Sums {
    has_gap: bool,
    yaw: YawSums,
    squares: f64,
    samples: usize,
}

impl Sums {
    fn add(&mut self, step: &Step) {
        let Some(sent) = step.delayed.filter(|_| step.is_compared) else { return };
        let Some(truth) = step.input.reference else {
            self.has_gap = true;
            return;
        };
        let rate = sent.rate.rad_per_sec();
        self.yaw.add(rate, truth);
        self.squares += (rate - truth) * (rate - truth);
        self.samples += 1;
    }

    fn score(&self, name: &str) -> Option<Score> {
        let error = self.yaw.error().filter(|_| !self.has_gap)?;
        Some(Score {
            name: name.to_owned(),
            error,
            rms_rad_per_s: (self.squares / self.samples as f64).sqrt(),
        })
    }
}
