//! The estimates that are sent, built from compensated rates: yaw, expected error, status, faults, the other axes.

use super::{BoardState, Origin, Pipeline, Rates, Turning};
use crate::bias::ZeroRate;
use crate::compensate::Compensated;
use crate::estimate::{VehicleSample, YawEstimate};
use crate::heading::filter::COARSE_BIAS;
use crate::health::{Faults, Quality, Source, Status, judge};
use crate::sample::{Frame, PERIOD_US, Validity, WheelSample};
use crate::sqrt::sqrt;
use crate::standstill::Standing;
use crate::units::{AngularRate, Yaw};

impl Pipeline {
    #[inline(never)]
    pub(super) fn report(
        &mut self,
        frame: &Frame,
        rates: &Rates,
        wheels: Option<&WheelSample>,
        board: &BoardState,
    ) -> VehicleSample {
        (self.state.tick, self.state.silent) = (frame.tick, 0);
        let faults = self.faults(wheels, board);
        let accepted = self.state.windows.accepted;
        let is_early = rates.early_sigma.is_some();
        let bias = self.bias_sigma(rates.early_sigma, board.shift);
        // No window corrects it.
        let mut live = self.estimate(frame, rates.live.as_ref(), is_early, board, (false, accepted));
        if has_sigma(live.status) {
            let origin = origin(live.status, rates.live.as_ref(), false);
            live.sigma = Some(self.state.uncertainty.sigma(origin, bias));
        }
        let is_calibrated = self.is_calibrated();
        self.state.uncertainty.calibrated(is_calibrated);
        if let Some((_, sigma)) = self.gain_by_course() {
            self.state.uncertainty.gain(sigma);
        }
        let (variance, is_levelled) = self.tilt_variance();
        self.state.uncertainty.tilt(variance, is_levelled);
        let covered = accepted || rates.delayed.as_ref().is_some_and(|rate| rate.covered);
        let has_model = self.config.compensate.model;
        let mut delayed = self.estimate(frame, rates.delayed.as_ref(), is_early, board, (has_model, covered));
        for estimate in [&mut live, &mut delayed] {
            estimate.faults = estimate.faults.with(faults);
            if estimate.quality == Quality::Good && (self.state.moved || !self.is_bias_confirmed()) {
                estimate.quality = Quality::Degraded;
            }
        }
        let [live_turn, delayed_turn] =
            [&live, &delayed].map(|estimate| board.clock_ratio.turned(estimate.rate));
        self.state.live_yaw.add(&mut live, live_turn);
        let missed = self.state.delayed_yaw.add(&mut delayed, delayed_turn);
        self.state.uncertainty.miss(missed);
        if has_sigma(delayed.status) {
            let turning = self.turning(frame, rates, delayed.status, bias);
            self.state.uncertainty.add(&turning);
            delayed.sigma = Some(self.state.uncertainty.sigma(turning.origin, bias));
        }
        let raw = frame.sample.angular_rate;
        let known = self.state.initialised.as_ref();
        let [roll_rate, pitch_rate, _] = known.map_or(raw, |known| known.zero.less(raw));
        VehicleSample {
            live,
            delayed,
            roll_rate,
            pitch_rate,
            specific_force: frame.sample.specific_force,
            temperature: frame.sample.temperature,
            tick: frame.tick,
        }
    }

    /// Builds the set of a silent sensor, `steps` after the last one: no rate, no force, the yaw unchanged.
    pub fn silent(&mut self, steps: u32, board: &BoardState) -> VehicleSample {
        self.state.tick = self.state.tick.wrapping_add(steps);
        self.state.silent = self.state.silent.saturating_add(steps);
        self.state.standing = Standing::UNKNOWN;
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
            live: yaw(self.state.live_yaw.yaw),
            delayed: yaw(self.state.delayed_yaw.yaw),
            tick: self.state.tick,
            ..VehicleSample::default()
        }
    }

    /// Returns the faults that hold now, whichever sample a message is of.
    fn faults(&self, wheels: Option<&WheelSample>, board: &BoardState) -> Faults {
        self.state
            .windows
            .faults
            .with(Faults::GAP.when(self.state.gap_within > 0))
            .with(
                Faults::IMPLAUSIBLE.when(self.state.moved || self.state.compensator.revisions_exceed_limit()),
            )
            .with(Faults::WHEELS.when(self.state.standing.is_contradicted || self.has_lost_wheels(wheels)))
            .with(board.faults.faults())
    }

    fn has_lost_wheels(&self, wheels: Option<&WheelSample>) -> bool {
        let Some(WheelSample { speeds, .. }) = wheels else { return false };
        let lost = |(speed, seen): (&Option<_>, bool)| seen && speed.is_none();
        speeds.iter().all(Option::is_none) || speeds.iter().zip(self.state.wheels_seen).any(lost)
    }

    /// Returns false while the bias rests on one standstill alone, and what the vehicle stood on may have turned.
    pub(super) fn is_bias_confirmed(&self) -> bool {
        self.zero_rate().is_none_or(ZeroRate::is_confirmed)
    }

    /// Returns the sigma of what adds linearly, rad/s: bias, `shift` since a jump, revisions that are carried.
    fn bias_sigma(&self, early: Option<f32>, shift: f32) -> f32 {
        let sigma = early.unwrap_or_else(|| self.zero_rate().map_or(0.0, ZeroRate::sigma));
        let carried = self.state.compensator.carried_in_a_second();
        // The bias may have changed.
        let drifts = if self.state.course.state().is_contradicted { COARSE_BIAS } else { 0.0 };
        sqrt(sigma * sigma + shift * shift + carried * carried + drifts * drifts)
    }

    /// Returns what a delayed rate contributes to the expected error; before there is one, the reading itself.
    fn turning(&self, frame: &Frame, rates: &Rates, status: Status, bias: f32) -> Turning {
        let rate = rates.delayed.as_ref();
        let origin = origin(status, rate, self.config.compensate.model);
        let Some(Compensated { rate, roll_and_pitch: [roll, pitch], estimate, withheld, .. }) = rate else {
            let (rates, none) = (frame.sample.angular_rate, AngularRate::ZERO);
            return Turning { rates, estimate: none, withheld: none, origin, bias };
        };
        let rates = [*roll, *pitch, *rate];
        match *withheld {
            Some(withheld) => Turning { rates, estimate: AngularRate::ZERO, withheld, origin, bias },
            None => Turning { rates, estimate: *estimate, withheld: AngularRate::ZERO, origin, bias },
        }
    }

    /// Builds the estimate of one rate, without yaw and sigma. Until there is one it has the gyro's reading, degraded
    /// where a bias is known early. `has_model`: windows correct it, `is_ready` once they do.
    fn estimate(
        &self,
        frame: &Frame,
        rate: Option<&Compensated>,
        is_early: bool,
        board: &BoardState,
        (has_model, is_ready): (bool, bool),
    ) -> YawEstimate {
        let validity = rate.map_or(frame.sample.validity, |rate| rate.validity);
        let status = match validity {
            Validity::Stuck => Status::Stuck,
            Validity::Saturated | Validity::Recovering | Validity::Implausible => Status::Clipped,
            Validity::Good if rate.is_none() && !is_early => Status::Init,
            Validity::Good if rate.is_some() && is_ready => Status::Ready,
            Validity::Good => Status::Degraded,
        };
        let (source, quality) = judge(status);
        let source = if source == Source::Model && !has_model { Source::Static } else { source };
        let quality =
            if self.is_bias_coarse() && quality == Quality::Good { Quality::Degraded } else { quality };
        let [.., raw] = frame.sample.angular_rate;
        let tick = rate.map_or(frame.tick, |rate| rate.tick);
        YawEstimate {
            tick,
            rate: rate.map_or(raw, |rate| rate.rate),
            correction: rate.map_or(AngularRate::ZERO, |rate| rate.correction),
            yaw: Yaw(0),
            sigma: None,
            status,
            source,
            quality: board.faults.cap_quality(quality),
            faults: Faults::of(validity),
            // From sample to sample: the pipeline has no clock to measure its own time.
            latency_us: Some(frame.tick.wrapping_sub(tick).saturating_mul(PERIOD_US as u32)),
        }
    }
}

fn has_sigma(status: Status) -> bool {
    matches!(status, Status::Ready | Status::Degraded)
}

/// Returns how a usable rate was found; without the model's corrections it is the gyro's.
fn origin(status: Status, rate: Option<&Compensated>, has_model: bool) -> Origin {
    match (rate.and_then(|rate| rate.withheld), status) {
        (Some(_), _) => Origin::Standstill,
        (None, Status::Ready) if has_model => Origin::Network,
        (None, _) => Origin::Gyro,
    }
}
