//! The contribution of each part of the compensation: the error of the delayed rate
//! with different configurations, all of which the board can run.

use crate::board::{Board, Step, Uncorrected};
use crate::drive::replay::{ReplayError, Steps};
use crate::drive::stream::Drive;
use crate::evaluate::metrics::{WINDOW, YawError, YawSums};
use crate::evaluate::rates::{silent, with_lag};
use gyronet::compensate::{CompensateConfig, Lag, Mode};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::Standstill;
use serde::Serialize;

#[derive(Debug, Clone)]
pub struct Variant {
    pub name: String,
    pub config: PipelineConfig,
    /// True if the network runs; otherwise the corrections are zero.
    pub network: bool,
    /// True if the vehicle's bus has wheel speeds.
    pub wheels: bool,
}

impl Variant {
    fn new(name: impl Into<String>, config: PipelineConfig) -> Self {
        Self { name: name.into(), config, network: true, wheels: true }
    }
}

/// Returns the default configuration with another mode.
fn with_mode(mode: Mode) -> PipelineConfig {
    let compensate = CompensateConfig { mode, ..CompensateConfig::DEFAULT };
    PipelineConfig { compensate, ..PipelineConfig::DEFAULT }
}

pub fn parts() -> Vec<Variant> {
    let alone = |config| PipelineConfig { zero_rate: None, ..config };
    let overlap = CompensateConfig::DEFAULT.mode;
    vec![
        Variant { network: false, ..Variant::new("static initialisation", alone(PipelineConfig::DEFAULT)) },
        Variant { network: false, ..Variant::new("+ zero-rate updates", PipelineConfig::DEFAULT) },
        Variant::new("newest, complete", alone(with_lag(with_mode(Mode::Newest), Lag::MAX))),
        Variant::new("middle, complete", alone(with_lag(with_mode(Mode::Middle), Lag::MAX))),
        Variant::new("overlap, at once", alone(with_lag(with_mode(overlap), Lag::NONE))),
        Variant::new("overlap, complete", alone(with_lag(with_mode(overlap), Lag::MAX))),
        Variant::new("overlap, default lag", alone(PipelineConfig::DEFAULT)),
        Variant { wheels: false, ..Variant::new("+ updates, no wheels", PipelineConfig::DEFAULT) },
        Variant::new("+ zero-rate updates", PipelineConfig::DEFAULT),
    ]
}

/// Returns the default configuration at every lag.
pub fn lags() -> Vec<Variant> {
    (0..)
        .map_while(Lag::new)
        .map(|lag| {
            let config = with_lag(PipelineConfig::DEFAULT, lag);
            Variant::new(format!("lag {} ms", 10 * lag.samples()), config)
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

/// The error of the reference itself in whole seconds in which the wheels stand. Smaller errors cannot be measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Floor {
    pub seconds: usize,
    /// Mean absolute yaw change in one second, rad.
    pub mean_1s_rad: f64,
    /// Mean rate over all seconds, rad/s.
    pub bias_rad_per_s: f64,
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
    for Variant { name, config, network: with_network, wheels } in variants {
        let wheels = wheels.then(|| drive.wheels()).flatten();
        let network: &mut dyn WindowNetwork = if *with_network { network } else { &mut Uncorrected };
        let mut sums = Sums::default();
        for step in Steps::new(drive, Board::new(silent(*config), wheels, network))? {
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

/// Returns the reference's error while the wheels stand; `None` if the drive has no wheels or they never stand.
pub fn floor(drive: &Drive<'_>) -> Result<Option<Floor>, ReplayError> {
    let Some(wheels) = drive.wheels() else { return Ok(None) };
    let board = Board::new(silent(PipelineConfig::DEFAULT), Some(wheels), Uncorrected);
    // The sum of the second in progress, while the wheels have stood in all of it.
    let (mut sum, mut samples) = (Some(0.0), 0);
    let (mut seconds, mut magnitudes, mut means) = (0, 0.0, 0.0);
    for step in Steps::new(drive, board)? {
        let Step { input, standstill, .. } = step?;
        let still = input.reference.filter(|_| standstill == Standstill::Still);
        sum = sum.zip(still).map(|(sum, rate)| sum + rate);
        samples += 1;
        if samples == WINDOW {
            if let Some(sum) = sum {
                let mean: f64 = sum / WINDOW as f64;
                (seconds, magnitudes, means) = (seconds + 1, magnitudes + mean.abs(), means + mean);
            }
            (sum, samples) = (Some(0.0), 0);
        }
    }
    let count = seconds as f64;
    Ok((seconds > 0).then(|| Floor {
        seconds,
        mean_1s_rad: magnitudes / count,
        bias_rad_per_s: means / count,
    }))
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
