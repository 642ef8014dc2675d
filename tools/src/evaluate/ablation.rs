//! This module measures what each part of the compensation contributes. It computes the error of the navigation rate
//! with different configurations, all of which the board can run.

use crate::drive::recording::Recording;
use crate::drive::replay::{Replay, ReplayError, Step};
use crate::drive::wheel_frames::WheelFrames;
use crate::evaluate::metrics::{WINDOW, YawError};
use gyronet::compensate::{CompensateConfig, Lag, Mode};
use gyronet::estimate::YawEstimate;
use gyronet::model::window::Features;
use gyronet::model::{Estimate, WindowNetwork};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::Standstill;
use gyronet::units::AngularRate;
use serde::Serialize;

/// A configuration to compare.
#[derive(Debug, Clone)]
pub struct Variant {
    /// The name in tables.
    pub name: String,
    /// The configuration.
    pub config: PipelineConfig,
    /// Whether the network runs; otherwise the corrections are zero.
    pub network: bool,
    /// Whether the vehicle's bus has wheel speeds.
    pub wheels: bool,
}

impl Variant {
    fn new(name: impl Into<String>, config: PipelineConfig) -> Self {
        Self { name: name.into(), config, network: true, wheels: true }
    }
}

/// A network whose corrections are zero.
pub(crate) struct Uncorrected;

impl WindowNetwork for Uncorrected {
    fn estimate(&mut self, _window: &[Features; gyronet::model::window::WINDOW]) -> Estimate {
        let corrections = [AngularRate::ZERO; gyronet::model::window::WINDOW];
        // A scale of 1e-3 rad/s gives a second the sigma of an uncorrected rate.
        Estimate { corrections, scale: AngularRate(134_218), ..Estimate::NONE }
    }
}

/// Returns the default configuration with another mode.
fn with_mode(mode: Mode) -> PipelineConfig {
    let compensate = CompensateConfig { mode, ..CompensateConfig::DEFAULT };
    PipelineConfig { compensate, ..PipelineConfig::DEFAULT }
}

/// Returns a configuration with another lag of the navigation rate.
pub(crate) fn with_lag(config: PipelineConfig, lag: Lag) -> PipelineConfig {
    let compensate = CompensateConfig { lag, ..config.compensate };
    PipelineConfig { compensate, ..config }
}

/// Returns the variants that show the parts of the compensation.
#[must_use]
pub fn parts() -> Vec<Variant> {
    let alone = |config| PipelineConfig { zero_rate: None, ..config };
    let overlap = CompensateConfig::DEFAULT.mode;
    vec![
        Variant { network: false, ..Variant::new("static initialisation", alone(PipelineConfig::DEFAULT)) },
        Variant { network: false, ..Variant::new("+ zero-rate updates", PipelineConfig::DEFAULT) },
        Variant::new("newest, settled", alone(with_lag(with_mode(Mode::Newest), Lag::MAX))),
        Variant::new("middle, settled", alone(with_lag(with_mode(Mode::Middle), Lag::MAX))),
        Variant::new("overlap, at once", alone(with_lag(with_mode(overlap), Lag::NONE))),
        Variant::new("overlap, settled", alone(with_lag(with_mode(overlap), Lag::MAX))),
        Variant::new("overlap, default lag", alone(PipelineConfig::DEFAULT)),
        Variant { wheels: false, ..Variant::new("+ updates, no wheels", PipelineConfig::DEFAULT) },
        Variant::new("+ zero-rate updates", PipelineConfig::DEFAULT),
    ]
}

/// Returns the default configuration at every lag.
#[must_use]
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
    /// The variant's name.
    pub name: String,
    /// The yaw error.
    #[serde(flatten)]
    pub error: YawError,
    /// RMS error of a sample, rad/s.
    pub rms_rad_per_s: f64,
    /// Shares of the 1 s errors within one, two and three sigma.
    pub inside_sigma: [f64; 3],
    /// Mean sigma of a second, rad.
    pub sigma_rad: f64,
}

/// The error of the reference itself in whole seconds in which the wheels stand. Smaller errors cannot be measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Floor {
    /// Number of whole seconds.
    pub seconds: usize,
    /// Mean absolute yaw change in one second, rad.
    pub mean_1s_rad: f64,
    /// Mean rate over all seconds, rad/s.
    pub bias_rad_per_s: f64,
}

/// Runs the variants on one drive; `tick` is called for each row of each run.
///
/// # Errors
/// [`ReplayError`].
pub fn run(
    recording: &Recording,
    network: &mut impl WindowNetwork,
    variants: &[Variant],
    mut tick: impl FnMut(),
) -> Result<Vec<Score>, ReplayError> {
    variants
        .iter()
        .filter_map(|Variant { name, config, network: with_network, wheels }| {
            let wheels = wheels.then(|| WheelFrames::new(recording)).flatten();
            let drive = if *with_network {
                Replay::run(recording, config, wheels, network, &mut tick)
            } else {
                Replay::run(recording, config, wheels, &mut Uncorrected, &mut tick)
            };
            let drive = match drive {
                Ok(drive) => drive,
                Err(error) => return Some(Err(error)),
            };
            let compared = drive.steps[drive.compared()].iter();
            let reference: Vec<f64> =
                compared.map(|step| recording.rows[step.row].reference).collect::<Option<_>>()?;
            Some(Ok(score(name, &drive.navigation().collect::<Vec<_>>(), &reference)?))
        })
        .collect()
}

/// Returns the means over drives with equal weights; `None` without drives.
#[must_use]
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
            inside_sigma: std::array::from_fn(|n| mean(&|score| score.inside_sigma[n])),
            sigma_rad: mean(&|score| score.sigma_rad),
        })
    };
    (0..first.len()).map(of).collect()
}

/// Returns the reference's error while the wheels stand; `None` if the drive has no wheels or they never stand.
#[must_use]
pub fn floor(recording: &Recording) -> Option<Floor> {
    let wheels = Some(WheelFrames::new(recording)?);
    let drive = Replay::run(recording, &PipelineConfig::DEFAULT, wheels, &mut Uncorrected, || {}).ok()?;
    let reference =
        |step: &Step| recording.rows[step.row].reference.filter(|_| step.standstill == Standstill::Still);
    let still: Vec<Option<f64>> = drive.steps.iter().map(reference).collect();
    let whole =
        still.chunks_exact(WINDOW).filter_map(|second| second.iter().copied().collect::<Option<Vec<_>>>());
    let means: Vec<f64> = whole.map(|second| second.iter().sum::<f64>() / WINDOW as f64).collect();
    let count = (!means.is_empty()).then_some(means.len() as f64)?;
    Some(Floor {
        seconds: means.len(),
        mean_1s_rad: means.iter().map(|mean| mean.abs()).sum::<f64>() / count,
        bias_rad_per_s: means.iter().sum::<f64>() / count,
    })
}

fn score(name: &str, rates: &[YawEstimate], reference: &[f64]) -> Option<Score> {
    let rate: Vec<f64> = rates.iter().map(|rate| rate.rate.rad_per_sec()).collect();
    let error = YawError::new(&rate, reference)?;
    let errors: Vec<f64> = rate.iter().zip(reference).map(|(rate, truth)| rate - truth).collect();
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    let (mut inside, mut sigmas, mut seconds) = ([0.0; 3], 0.0, 0.0);
    for (errors, rates) in errors.chunks_exact(WINDOW).zip(rates.chunks_exact(WINDOW)) {
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / WINDOW as f64;
        let error = mean(&mut errors.iter().copied()).abs();
        let sigma = mean(&mut rates.iter().filter_map(|rate| rate.sigma).map(|sigma| sigma.rad_per_sec()));
        for (n, inside) in (1..).zip(&mut inside) {
            *inside += f64::from(u8::from(error <= f64::from(n) * sigma));
        }
        sigmas += sigma;
        seconds += 1.0;
    }
    Some(Score {
        name: name.to_owned(),
        error,
        rms_rad_per_s: rms,
        inside_sigma: inside.map(|count| count / seconds),
        sigma_rad: sigmas / seconds,
    })
}
