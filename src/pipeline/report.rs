//! This module builds the sent estimates from compensated rates: yaw, uncertainty, status, faults, the other axes.

use super::{Pipeline, Rates};
use crate::bias::ZeroRate;
use crate::compensate::Compensated;
use crate::estimate::{VehicleSample, YawEstimate};
use crate::health::{Faults, Status, judge};
use crate::sample::{Frame, ImuSample, PERIOD_US, Validity};
use crate::units::{AngularRate, Yaw};

impl Pipeline {
    /// Builds the message set of a sample.
    #[inline(never)]
    pub(super) fn report(&mut self, frame: &Frame, rates: &Rates) -> VehicleSample {
        self.state.tick = frame.tick;
        let faults = self.faults(&frame.sample);
        let accepted = self.state.windows.is_accepted();
        let prompt = self.estimate(
            frame,
            rates.prompt,
            rates.early_sigma,
            |_| accepted,
            |pipeline| &mut pipeline.state.prompt_yaw,
        );
        let covered = |rate: &Compensated| rate.covered || accepted;
        let navigation = self.estimate(frame, rates.navigation, rates.early_sigma, covered, |pipeline| {
            &mut pipeline.state.navigation_yaw
        });
        let zero =
            self.state.initialised.as_ref().map_or([AngularRate::ZERO; 3], |known| known.zero.reading());
        let [roll_rate, pitch_rate, _] = frame.sample.angular_rate;
        let less = |rate: AngularRate, zero: AngularRate| AngularRate(rate.0.saturating_sub(zero.0));
        VehicleSample {
            prompt: YawEstimate { faults, ..prompt },
            navigation: YawEstimate { faults, ..navigation },
            roll_rate: less(roll_rate, zero[0]),
            pitch_rate: less(pitch_rate, zero[1]),
            specific_force: frame.sample.specific_force,
            temperature: frame.sample.temperature,
            tick: frame.tick,
        }
    }

    /// Builds the message set of a silent sensor, `steps` grid steps after the last one: no rate, no force, and the
    /// yaw unchanged.
    #[must_use]
    pub fn silent(&mut self, steps: u32) -> VehicleSample {
        self.state.tick = self.state.tick.wrapping_add(steps);
        let status = Status::Silent;
        let (source, quality) = judge(status);
        let faults = self.state.board.faults().with(Faults::GAP);
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
            prompt: yaw(self.state.prompt_yaw),
            navigation: yaw(self.state.navigation_yaw),
            tick: self.state.tick,
            ..VehicleSample::default()
        }
    }

    /// Returns the faults that hold for this sample.
    fn faults(&self, sample: &ImuSample) -> Faults {
        let contradicted = self.zero_rate().is_some_and(ZeroRate::contradicted);
        self.state
            .windows
            .faults()
            .with(Faults::of(sample.validity))
            .with(Faults::GAP.when(self.state.gap_within > 0))
            .with(Faults::IMPLAUSIBLE.when(self.state.moved || self.state.compensator.carry_exceeds_limit()))
            .with(Faults::WHEELS.when(self.state.wheels.are_silent() || contradicted))
            .with(self.state.board.faults())
    }

    /// Builds the estimate of one rate. Until a rate exists the estimate carries the gyro's own reading, with the
    /// sigma of the bias curve where there is one.
    fn estimate(
        &mut self,
        frame: &Frame,
        rate: Option<Compensated>,
        early_sigma: Option<f32>,
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
        let turned = used.map_or(0, |rate| self.state.clock_ratio.turned(rate));
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
            quality: self.state.board.cap_quality(quality),
            faults: Faults::NONE,
            // From sample to sample: the pipeline has no clock to measure its own time.
            latency_us: Some(frame.tick.wrapping_sub(tick).saturating_mul(PERIOD_US as u32)),
        }
    }
}
