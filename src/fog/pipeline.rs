//! The pipeline computes the rate that is sent every 10 ms from a fibre-optic gyro's samples. `src/can/README.md`
//! lists its states.
//!
//! The gyro's increments are summed over steps of the caller's time ([`FogGrid`]). Each step uses the newest readings
//! of inertial sensor and wheels, a step or two old. A step that differs from the inertial gyro as no vehicle turns in
//! 10 ms is unusable, and after two seconds of that degraded (IMPLAUSIBLE). Repetition is judged by the increments as
//! they are sent ([`STUCK_AFTER`], [`STUCK_US`]): one that straddles two steps is split, and rounding makes sums of
//! equal ones differ.

use super::beside::{Beside, Comparison};
use super::{EarthAndBias, FogConfig, IncrementRate, RestOutcome};
use crate::align::clock::ClockError;
use crate::align::clock_ratio::{ClockRatio, RatioEstimator};
use crate::align::fog_grid::FogGrid;
use crate::bias::Latitude;
use crate::estimate::{AccumulatedYaw, YawEstimate};
use crate::health::{Faults, Quality, Source, Status, count, counters};
use crate::sample::{FogSample, PERIOD_US, RATE_HZ, Standstill, WheelSample};
use crate::sqrt::sqrt;
use crate::units::{Angle, AngularRate, Micros, Yaw};

/// Increments that equal the one before, for [`STUCK_US`], of a stuck gyro. In a DSP-3000's noise, a hundred units in
/// 10 ms, one in four hundred repeats, and four in a row once in years.
pub const STUCK_AFTER: u8 = 4;
/// Duration of these increments, us: ten of a DSP-1760, whose noise in 1 ms never repeats.
pub const STUCK_US: u32 = 10_000;

/// Share by which a clock may be off before it has been measured: a quarter of what is accepted.
const CLOCK: f32 = 0.01;

counters! {
    pub struct FogCounters {
        pub samples: u32,
        /// Samples refused: duplicate or out of order.
        pub misplaced: u32,
        /// Grid steps without a turn: increments are missing, or the gyro is stuck.
        pub gaps: u32,
        pub stuck: u32,
        /// Steps without a known latitude: the Earth's rate is not subtracted.
        pub no_latitude: u32,
        pub zero_rate_updates: u32,
        /// Seconds in which the gyro contradicted that the vehicle stands.
        pub contradicted: u32,
    }
}

#[derive(Debug, Clone)]
pub struct FogPipeline {
    grid: FogGrid,
    earth_and_bias: EarthAndBias,
    /// Compares the gyro's clock with the board's, where that is better.
    clock: Option<RatioEstimator>,
    /// Unit and sign of the gyro's output have been shown; a standstill has contradicted them.
    pub is_confirmed: bool,
    was_refused: bool,
    beside: Comparison,
    pub shown: Option<f32>,
    latitude_contested: bool,
    shake: [f32; 2],
    rate: IncrementRate,
    correction: IncrementRate,
    yaw: AccumulatedYaw,
    repeats: Repeats,
    stuck_in_step: bool,
    pub counters: FogCounters,
}

impl FogPipeline {
    /// Creates a pipeline. Where a gyro is `expected`, rates are sent from time 0 on, and its silence is reported.
    pub const fn new(config: FogConfig, expected: bool) -> Self {
        Self {
            grid: FogGrid::new(expected),
            earth_and_bias: EarthAndBias::new(config.errors, config.tilt, config.latitude),
            clock: if config.clock_is_exact { Some(RatioEstimator::START) } else { None },
            is_confirmed: false,
            was_refused: false,
            beside: Comparison::START,
            shown: None,
            latitude_contested: false,
            shake: config.shake,
            rate: IncrementRate::START,
            correction: IncrementRate::START,
            yaw: AccumulatedYaw::START,
            repeats: Repeats::NONE,
            stuck_in_step: false,
            counters: FogCounters::NONE,
        }
    }

    /// Sets the latitude. The gyro's bias is kept if the vehicle has `moved` there, else the former was wrong.
    pub fn set_latitude(&mut self, latitude: Latitude, moved: bool) {
        self.earth_and_bias.set_latitude(Some(latitude), moved);
    }

    pub fn contest_latitude(&mut self, contested: bool) {
        self.latitude_contested = contested;
    }

    /// Notes that another gyro agrees in a turn: unit and sign of the output are those of the configuration.
    pub fn confirm(&mut self) {
        self.is_confirmed = true;
    }

    pub fn beside(&mut self, beside: Beside) {
        self.beside.take(beside);
    }

    pub fn gaps(&self) -> Option<u32> {
        self.yaw.gaps()
    }

    /// Adds a sample that arrived at `now`, or counts it; then call [`FogPipeline::next_step`] until `None`.
    pub fn add(&mut self, now: Micros, mut sample: FogSample) -> Result<(), ClockError> {
        let repeats = self.repeats.after(&sample);
        let stuck = repeats.are_stuck();
        if stuck {
            let [.., up] = &mut sample.increment;
            *up = None;
        }
        if let Some(clock) = &mut self.clock {
            clock.observe(sample.time, now);
            let ratio = clock.ratio;
            let turns = sample.increment.iter_mut().flatten().filter(|_| ratio != ClockRatio::ONE);
            turns.for_each(|turn| *turn = ratio.angle(*turn));
        }
        self.grid.add(now, sample).inspect_err(|_| count(&mut self.counters.misplaced, 1))?;
        count(&mut self.counters.samples, 1);
        count(&mut self.counters.stuck, u32::from(stuck && !self.repeats.are_stuck()));
        self.repeats = repeats;
        self.stuck_in_step |= stuck;
        Ok(())
    }

    /// Returns whether rates are sent, of a gyro that is expected or has sent something.
    pub fn is_running(&self) -> bool {
        self.grid.is_running()
    }

    pub fn is_due(&self, now: Micros) -> bool {
        self.grid.is_due(now)
    }

    /// Returns the rate of the next 10 ms, if they are complete or due; `None` before the first sample, unless one is
    /// expected. Also call it every few milliseconds, because it detects silence.
    #[inline(never)]
    pub fn next_step(&mut self, now: Micros, wheels: Option<&WheelSample>) -> Option<YawEstimate> {
        let step = self.grid.next_step(now)?;
        let [.., turn] = step.turn.angle;
        let turn = turn.filter(|_| u64::from(step.turn.covered) == PERIOD_US);
        let reading = self.earth_and_bias.rest.reading();
        self.shown = turn.map(|turn| turn.0 as f32 * (RATE_HZ as f32 / Angle::PER_RAD) - reading);
        let differs = self.shown.is_some_and(|rate| self.beside.differs(rate, step.time));
        let wrong = differs && self.beside.rejects();
        let contradicts_other = differs || self.beside.contradicts();
        let turn = turn.filter(|_| !wrong);
        let stuck = turn.is_none() && self.stuck_in_step;
        self.stuck_in_step = self.repeats.are_stuck();
        let standstill = wheels.map_or(Standstill::Unknown, |wheels| wheels.standstill);
        let (kept, outcome) = self.earth_and_bias.correct(turn, standstill);
        self.count_rest(outcome);
        self.was_refused |= outcome == Some(RestOutcome::Refused);
        self.is_confirmed |= outcome == Some(RestOutcome::Used) && self.earth_and_bias.rest.shows_unit();
        let is_clock_off = self.clock.as_ref().is_some_and(|clock| clock.fault);
        let contradicts_unit = self.was_refused && !self.is_confirmed;
        let has_rear = wheels.and_then(WheelSample::axle).is_some();
        let has_latitude = self.earth_and_bias.latitude.is_some();
        count(&mut self.counters.gaps, u32::from(turn.is_none()));
        let latency_us = u32::try_from(now.0.saturating_sub(step.time.0)).ok();
        let contradicted = self.earth_and_bias.rest.is_contradicted();
        count(&mut self.counters.no_latitude, u32::from(!has_latitude));
        let faults = Faults::STUCK
            .when(stuck)
            .with(Faults::GAP.when(turn.is_none() && !stuck && !wrong))
            .with(Faults::WHEELS.when(!has_rear || contradicted))
            .with(
                Faults::IMPLAUSIBLE
                    .when(self.latitude_contested || is_clock_off || contradicts_unit || contradicts_other),
            );
        let is_good = faults == Faults::NONE && self.is_confirmed;
        let (status, source, quality) = match turn {
            None if stuck => (Status::Stuck, Source::Raw, Quality::Unusable),
            None => (Status::Silent, Source::Raw, Quality::Unusable),
            Some(_) if has_latitude && is_good => (Status::Ready, Source::EarthRate, Quality::Good),
            Some(_) => (Status::Degraded, self.source(), Quality::Degraded),
        };
        let (rate, correction) = match (turn, kept) {
            (Some(turn), Some(kept)) => {
                let correction = Angle(turn.0.saturating_sub(kept.0));
                (self.rate.rate(kept), self.correction.rate(correction))
            }
            _ => (AngularRate::ZERO, AngularRate::ZERO),
        };
        let tick = (step.time.0 / PERIOD_US) as u32;
        let [standing, moving] = self.shake;
        let shake = if standstill == Standstill::Still { standing } else { moving };
        let unknown = self.clock.as_ref().is_some_and(|clock| !clock.is_known);
        let clock = if unknown { CLOCK } else { 0.0 };
        let beside = self.beside.sigma(rate.0 as f32 / AngularRate::PER_RAD_PER_SEC, clock);
        let spread = sqrt(shake * shake + beside * beside);
        let sigma = turn.is_some().then(|| self.earth_and_bias.sigma(rate, spread));
        let yaw = Yaw(0);
        let mut estimate =
            YawEstimate { tick, rate, correction, yaw, sigma, status, source, quality, faults, latency_us };
        self.yaw.add(&mut estimate, i64::from(rate.0));
        Some(estimate)
    }

    fn source(&self) -> Source {
        match self.earth_and_bias.latitude {
            Some(_) => Source::EarthRate,
            None if self.earth_and_bias.rest.is_measured() => Source::Static,
            None => Source::Raw,
        }
    }

    fn count_rest(&mut self, outcome: Option<RestOutcome>) {
        count(&mut self.counters.zero_rate_updates, u32::from(outcome == Some(RestOutcome::Used)));
        count(&mut self.counters.contradicted, u32::from(outcome == Some(RestOutcome::Refused)));
    }
}

/// The newest increment, and the number and time of those that were equal to the one before.
#[derive(Debug, Clone, Copy)]
struct Repeats {
    newest: Option<Angle>,
    equal: u8,
    equal_us: u32,
}

impl Repeats {
    const NONE: Self = Self { newest: None, equal: 0, equal_us: 0 };

    fn after(self, sample: &FogSample) -> Self {
        let [.., newest] = sample.increment;
        if newest.is_none() || newest != self.newest {
            return Self { newest, ..Self::NONE };
        }
        Self {
            newest,
            equal: self.equal.saturating_add(1),
            equal_us: self.equal_us.saturating_add(sample.span),
        }
    }

    fn are_stuck(self) -> bool {
        self.equal >= STUCK_AFTER && self.equal_us >= STUCK_US
    }
}
