//! The estimates that are sent, built from compensated rates: yaw, expected error, status, faults, the other axes.
//!
//! The number sent with each rate is the expected error of the mean rate over one second, 1 sigma: over a single sample
//! vibration outweighs every other error, and no car changes its heading much in 10 ms. Its two parts are taken as
//! independent: the network's, from the error that it predicts for its windows ([`crate::model::Estimate::scale`]), and
//! the bias's, from the zero-rate updates.

use super::{BoardState, Pipeline, Rates};
use crate::bias::ZeroRate;
use crate::compensate::Compensated;
use crate::estimate::{VehicleSample, YawEstimate};
use crate::health::{Faults, Status, judge};
use crate::sample::{Frame, ImuSample, PERIOD_US, Validity, WheelSample};
use crate::sqrt::sqrt;
use crate::units::{AngularRate, Yaw};

impl Pipeline {
    /// Builds the message set of a sample.
    #[inline(never)]
    pub(super) fn report(
        &mut self,
        frame: &Frame,
        rates: &Rates,
        wheels: Option<&WheelSample>,
        board: &BoardState,
    ) -> VehicleSample {
        self.state.tick = frame.tick;
        let faults = self.faults(&frame.sample, wheels, board);
        let accepted = self.state.windows.is_accepted();
        let live = self.estimate(
            frame,
            rates.live,
            rates.early_sigma,
            board,
            |_| accepted,
            |pipeline| &mut pipeline.state.live_yaw,
        );
        let covered = |rate: &Compensated| rate.covered || accepted;
        let delayed = self.estimate(frame, rates.delayed, rates.early_sigma, board, covered, |pipeline| {
            &mut pipeline.state.delayed_yaw
        });
        let raw = frame.sample.angular_rate;
        let known = self.state.initialised.as_ref();
        let [roll_rate, pitch_rate, _] = known.map_or(raw, |known| known.zero.less(raw));
        VehicleSample {
            live: YawEstimate { faults, ..live },
            delayed: YawEstimate { faults, ..delayed },
            roll_rate,
            pitch_rate,
            specific_force: frame.sample.specific_force,
            temperature: frame.sample.temperature,
            tick: frame.tick,
        }
    }

    /// Builds the message set of a silent sensor, `steps` grid steps after the last one: no rate, no force, and the
    /// yaw unchanged.
    #[must_use]
    pub fn silent(&mut self, steps: u32, board: &BoardState) -> VehicleSample {
        self.state.tick = self.state.tick.wrapping_add(steps);
        let status = Status::Silent;
        let (source, quality) = judge(status);
        let faults = board.faults.faults().with(Faults::GAP);
        let yaw = |yaw| YawEstimate {
            tick: self.state.tick,
            yaw,
            status,
            source,
            quality,
            faults,
            ..YawEstimate::default()
        };
        VehicleSample {
            live: yaw(self.state.live_yaw),
            delayed: yaw(self.state.delayed_yaw),
            tick: self.state.tick,
            ..VehicleSample::default()
        }
    }

    /// Returns the faults that hold for this sample.
    fn faults(&self, sample: &ImuSample, wheels: Option<&WheelSample>, board: &BoardState) -> Faults {
        let contradicted = self.zero_rate().is_some_and(ZeroRate::contradicted);
        self.state
            .windows
            .faults()
            .with(Faults::of(sample.validity))
            .with(Faults::GAP.when(self.state.gap_within > 0))
            .with(
                Faults::IMPLAUSIBLE.when(self.state.moved || self.state.compensator.revisions_exceed_limit()),
            )
            .with(Faults::WHEELS.when(contradicted || self.has_lost_wheels(wheels)))
            .with(board.faults.faults())
    }

    /// Returns whether a wheel has lost its speed, or no wheel has one.
    fn has_lost_wheels(&self, wheels: Option<&WheelSample>) -> bool {
        let Some(WheelSample { speeds, .. }) = wheels else { return false };
        let lost = |(speed, seen): (&Option<_>, bool)| seen && speed.is_none();
        speeds.iter().all(Option::is_none) || speeds.iter().zip(self.state.wheels_seen).any(lost)
    }

    /// Builds the estimate of one rate. Until a rate exists the estimate carries the gyro's own reading, with the
    /// sigma of the bias curve where there is one.
    fn estimate(
        &mut self,
        frame: &Frame,
        rate: Option<Compensated>,
        early_sigma: Option<f32>,
        board: &BoardState,
        estimated: impl Fn(&Compensated) -> bool,
        yaw: impl Fn(&mut Self) -> &mut Yaw,
    ) -> YawEstimate {
        let estimated = rate.as_ref().is_some_and(estimated);
        let validity = rate.map_or(frame.sample.validity, |rate| rate.validity);
        let status = match validity {
            Validity::Stuck => Status::Stuck,
            Validity::Saturated | Validity::Recovering | Validity::Implausible => Status::Clipped,
            Validity::Good if rate.is_none() && early_sigma.is_none() => Status::Init,
            Validity::Good if estimated => Status::Ready,
            Validity::Good => Status::Degraded,
        };
        let [.., raw] = frame.sample.angular_rate;
        let used = rate.map(|rate| rate.rate).or_else(|| early_sigma.map(|_| raw));
        let bias = early_sigma.unwrap_or_else(|| self.zero_rate().map_or(0.0, ZeroRate::sigma));
        let sigma = used.map(|_| self.state.uncertainty.sigma(estimated, bias));
        let turned = used.map_or(0, |rate| board.clock_ratio.turned(rate));
        let yaw = yaw(self);
        yaw.0 = yaw.0.wrapping_add(turned);
        let yaw = *yaw;
        let tick = rate.map_or(frame.tick, |rate| rate.tick);
        let (source, quality) = judge(status);
        YawEstimate {
            tick,
            rate: used.unwrap_or(raw),
            correction: rate.map_or(AngularRate::ZERO, |rate| rate.correction),
            yaw,
            sigma,
            status,
            source,
            quality: board.faults.cap_quality(quality),
            faults: Faults::NONE,
            // From sample to sample: the pipeline has no clock to measure its own time.
            latency_us: Some(frame.tick.wrapping_sub(tick).saturating_mul(PERIOD_US as u32)),
        }
    }
}

/// Holds the factors that turn the network's predicted error into the error over a second.
#[derive(Debug, Clone, Copy)]
pub struct UncertaintyConfig {
    /// Sigma of a second's error over the RMS of the scales of its windows.
    pub per_scale: f32,
    /// Sigma of a second that the network has not corrected, rad/s.
    pub uncorrected: f32,
}

impl UncertaintyConfig {
    /// These factors were calibrated on the validation drive alone (`cargo gyronet evaluate --ablation`).
    pub const DEFAULT: Self = Self { per_scale: 0.25, uncorrected: 2.5e-4 };
}

/// The network's predicted error is averaged over this many windows: about a second at the default stride.
const WINDOWS: f32 = 20.0;

/// Tracks the expected error of the corrected rate.
#[derive(Debug, Clone)]
pub struct Uncertainty {
    config: UncertaintyConfig,
    /// Running mean square of the windows' scales, (rad/s)^2.
    scale_square: Option<f32>,
}

impl Uncertainty {
    /// Creates the state before the first window.
    #[must_use]
    pub const fn new(config: UncertaintyConfig) -> Self {
        Self { config, scale_square: None }
    }

    /// Adds the error that the network predicts for a window.
    pub fn window(&mut self, scale: AngularRate) {
        let scale = scale.0 as f32 / AngularRate::PER_RAD_PER_SEC;
        let square = scale * scale;
        let before = self.scale_square.unwrap_or(square);
        self.scale_square = Some(before + (square - before) / WINDOWS);
    }

    /// Returns the sigma of a rate, rounded up, from the `bias` sigma in rad/s; a rate not `corrected` by the network
    /// has a fixed sigma in place of the network's.
    #[must_use]
    pub fn sigma(&self, corrected: bool, bias: f32) -> AngularRate {
        let UncertaintyConfig { per_scale, uncorrected } = self.config;
        let own = match self.scale_square {
            Some(scale_square) if corrected => per_scale * per_scale * scale_square,
            _ => uncorrected * uncorrected,
        };
        let sigma = sqrt(own + bias * bias);
        // Beyond the code's range the cast saturates.
        AngularRate(libm::ceilf(sigma * AngularRate::PER_RAD_PER_SEC) as i32)
    }
}
