//! The pipeline computes the corrected yaw rates of each 10 ms of the inertial sensor.
//!
//! This file owns the order of the stages (grid, mounting, initialisation, window, compensation, zero-rate updates,
//! report), which do not import each other. The samples' own time stamps drive everything. The caller runs the
//! network: [`Output::window`] is a window that is due, and [`Pipeline::deliver`] accepts its estimate, which is used
//! exactly [`crate::compensate::Stride::delay`] samples after the window's newest one.

mod config;
mod course;
mod initialised;
mod level;
mod report;
mod sensor_bias;
mod status;
mod uncertainty;
mod windows;

pub use config::PipelineConfig;
pub(crate) use uncertainty::swing::Swing;
pub use uncertainty::{GyroErrors, Origin, Turning, Uncertainty, UncertaintyConfig};
pub use windows::DueWindow;
pub(crate) use windows::Handover;

use crate::align::clock_ratio::ClockRatio;
use crate::align::{AlignError, Aligner, MAX_GAP};
use crate::bias::{StaticError, StaticInit, ZeroRate, ZeroRateOutcome};
use crate::compensate::{Compensated, Compensator, Complete, Implausible};
use crate::estimate::{AccumulatedYaw, VehicleSample};
use crate::heading::{BRIDGED, Estimator};
use crate::health::{BoardFaults, Counters, Faults, count};
use crate::model::Estimate;
use crate::monitor::{AXIS_STUCK_AFTER, STUCK_AFTER};
use crate::sample::{Frame, ImuSample, PERIOD_US, Standstill, Validity, WHEELS, WheelSample};
use crate::standstill::{Judge, Standing};

use crate::model::window::{self, WINDOW};
use crate::mounting::Vertical;
use crate::units::{AngularRate, Yaw};
use course::Start;
use initialised::Initialised;
use sensor_bias::{SensorBias, ZeroPoint};
use windows::Windows;

/// The faults and the clock of the board, on which a sample's rates depend besides the sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardState {
    pub faults: BoardFaults,
    /// The true length of the steps of the sensor's clock, by which the rates are summed.
    pub clock_ratio: ClockRatio,
    /// The yaw rate by which the readings may be off since they have jumped or stepped unusually, rad/s.
    pub shift: f32,
}

impl BoardState {
    /// No fault, and a sensor whose clock is right.
    pub const GOOD: Self = Self { faults: BoardFaults::NONE, clock_ratio: ClockRatio::ONE, shift: 0.0 };
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Both rates and everything else that is sent, for [`crate::can::encoder::CanEncoder`].
    pub vehicle: VehicleSample,
    pub complete: Option<Complete>,
    /// A window for the network and [`Pipeline::deliver`], within [`crate::compensate::Stride::delay`] steps.
    pub window: Option<DueWindow>,
    /// The judgement of standstill; not likely where the gyro contradicts it.
    pub standing: Standing,
    pub refused: Option<StaticError>,
    pub implausible: Option<Implausible>,
    /// What standstills and turns have shown of the vertical, in the sensor's axes, where this sample has changed it.
    pub vertical: Option<Vertical>,
}

#[derive(Debug, Clone)]
pub struct Pipeline {
    config: PipelineConfig,
    state: State,
}

#[derive(Debug, Clone)]
struct State {
    aligner: Aligner,
    sensor_bias: SensorBias,
    standstill: Judge,
    standing: Standing,
    static_init: StaticInit,
    initialised: Option<Initialised>,
    course: Estimator,
    start: Start,
    windows: Windows,
    compensator: Compensator,
    uncertainty: Uncertainty,
    wheels_seen: [bool; WHEELS],
    /// Samples for which the vehicle has stood; zero while it moves.
    stood: u32,
    live_yaw: AccumulatedYaw,
    delayed_yaw: AccumulatedYaw,
    /// Grid step of the newest message set, and the sets without a sample since the newest one.
    tick: u32,
    silent: u32,
    /// Samples until the last gap is a whole window in the past.
    gap_within: u32,
    moved: bool,
    stuck: bool,
    rate_refused: bool,
    counters: Counters,
}

#[derive(Debug, Clone, Copy, Default)]
struct Rates {
    live: Option<Compensated>,
    delayed: Option<Compensated>,
    complete: Option<Complete>,
    /// Sigma of the reading's bias before static initialisation, rad/s, where earlier drives have shown the bias.
    early_sigma: Option<f32>,
}

impl Pipeline {
    pub const fn new(config: PipelineConfig) -> Self {
        let state = State {
            aligner: Aligner::START,
            sensor_bias: SensorBias::START,
            standstill: Judge::START,
            standing: Standing::UNKNOWN,
            static_init: StaticInit::new(config.static_init),
            initialised: None,
            course: Estimator::new(config.course),
            start: Start::EMPTY,
            windows: Windows::START,
            compensator: Compensator::new(config.compensate),
            uncertainty: Uncertainty::new(config.uncertainty),
            wheels_seen: [false; WHEELS],
            stood: 0,
            live_yaw: AccumulatedYaw::START,
            delayed_yaw: AccumulatedYaw::START,
            tick: 0,
            silent: 0,
            gap_within: 0,
            moved: false,
            stuck: false,
            rate_refused: false,
            counters: Counters::NONE,
        };
        Self { config, state }
    }

    /// Adds a sample; [`Pipeline::next_frame`] gives the steps that it completes. A refused one is counted; but for a
    /// duplicate, the next steps report [`Faults::GAP`].
    pub fn add(&mut self, sample: ImuSample) -> Result<(), AlignError> {
        let added = self.state.aligner.add(sample);
        self.state.rate_refused = matches!(added, Err(AlignError::Rate { .. }));
        added.inspect_err(|error| self.refuse(*error))
    }

    /// Returns the next step of the grid that the samples have completed; call it until `None` after each sample.
    pub fn next_frame(&mut self) -> Option<Frame> {
        self.state.aligner.next_frame()
    }

    pub(crate) fn has_piece(&self) -> bool {
        self.state.aligner.has_piece()
    }

    pub fn is_rate_refused(&self) -> bool {
        self.state.rate_refused
    }

    pub fn is_step_due(&self) -> bool {
        self.state.aligner.is_nearly_complete()
    }

    /// Adds a sample of a 100 Hz sensor, with its validity set, and corrects the step that it completes.
    pub fn correct(
        &mut self,
        sample: ImuSample,
        wheels: Option<&WheelSample>,
        board: &BoardState,
    ) -> Result<Output, AlignError> {
        self.add(sample)?;
        let frame = self.next_frame().ok_or(AlignError::Open { at: sample.time })?;
        Ok(self.step(frame, wheels, board))
    }

    /// Corrects a step of the grid; its sample's validity must have been set ([`crate::monitor`]). `wheels` is the newest
    /// report of [`crate::can::wheel::WheelReceiver`], `None` before its first frame.
    pub fn step(&mut self, mut frame: Frame, wheels: Option<&WheelSample>, board: &BoardState) -> Output {
        if let Some(WheelSample { speeds, .. }) = wheels {
            let seen = self.state.wheels_seen.iter_mut().zip(speeds);
            seen.for_each(|(seen, speed)| *seen |= speed.is_some());
        }
        let mut sample = frame.sample;
        let initialised = self.state.initialised.is_some();
        if self.state.sensor_bias.subtract(&mut sample, &self.config, initialised) {
            self.state.static_init.restart();
        }
        frame.sample = self.config.mounting.sample(&sample);
        frame.sample.angular_rate = self.config.gyro_map.rate(frame.sample.angular_rate);
        count(&mut self.state.counters.samples, 1);
        if frame.missing > 0 {
            count(&mut self.state.counters.missing, frame.missing);
            self.gap(frame.missing);
        }
        if !sample.validity.is_good() {
            count(&mut self.state.counters.invalid, 1);
            self.break_window();
        }
        let stuck = sample.validity == Validity::Stuck;
        if stuck && !core::mem::replace(&mut self.state.stuck, stuck) {
            // The readings before this one were no better.
            self.state.compensator.distrust(usize::from(STUCK_AFTER) - 1);
            self.lose(frame.tick, AXIS_STUCK_AFTER.into());
        }
        self.state.stuck = stuck;
        let implausible = self.use_estimate(frame.tick);
        let standing = self.state.standstill.observe(&frame.sample, wheels);
        let moves = wheels.is_some_and(|wheels| wheels.standstill == Standstill::Moving);
        let (rates, refused) = match self.level(&mut frame.sample, standing) {
            None => {
                let refused = self.initialise(&frame, standing, moves);
                let early = self.state.sensor_bias.early(&sample);
                if let Some((levelling, _)) = early {
                    frame.sample = levelling.sample(&frame.sample);
                }
                self.start_in_motion(&frame, early, standing);
                (Rates { early_sigma: early.map(|(_, sigma)| sigma), ..Rates::default() }, refused)
            }
            Some(zero) => (self.estimate_rates(&frame, &zero, standing, moves), None),
        };
        self.judge_start();
        if self.state.standstill.has_driven_off() {
            self.zero_rate_mut().map(ZeroRate::moves);
        }
        self.state.standing = self.judged(standing);
        let vehicle = self.report(&frame, &rates, wheels, board);
        let stride = self.config.compensate.stride.samples();
        let window = self.state.windows.due(frame.tick, stride);
        self.state.gap_within = self.state.gap_within.saturating_sub(1);
        let standing = self.state.standing;
        let vertical = self.new_vertical();
        Output { vehicle, complete: rates.complete, window, standing, refused, implausible, vertical }
    }

    /// Notes that the sensor was moved since earlier drives; it is reported with every message set from now on.
    pub fn mount_moved(&mut self) {
        if !core::mem::replace(&mut self.state.moved, true) {
            count(&mut self.state.counters.moved_mounts, 1);
            self.forget_gain();
        }
    }

    /// Accepts an estimate; returns whether it will be used: not if late, or asked for by no [`Output::window`].
    pub fn deliver(&mut self, end: u32, estimate: Estimate) -> bool {
        self.state.windows.deliver(end, estimate)
    }

    pub fn tick(&self) -> u32 {
        self.state.tick
    }

    /// Returns the share of a turn that a gyro about the vehicle's z axis misses, because the street is askew.
    pub fn tilted(&self) -> f32 {
        self.state.uncertainty.tilted().max(self.state.uncertainty.tilted_now()).max(self.ramp())
    }

    pub fn leaning(&self) -> f32 {
        self.state.uncertainty.leaning()
    }

    pub fn counters(&self) -> &Counters {
        &self.state.counters
    }

    /// Returns what the delayed yaw lacks: revisions that are not carried yet, and the samples whose rates are not sent yet.
    pub fn pending(&self) -> Yaw {
        Yaw(self.state.compensator.pending(self.remaining()))
    }

    /// Returns the gyro's static bias beyond that of earlier drives, once known.
    pub fn gyro_bias(&self) -> Option<[AngularRate; 3]> {
        self.state.initialised.as_ref().map(|known| known.zero.bias)
    }

    /// Returns the residual bias that the zero-rate updates have found beyond the static one.
    pub fn bias(&self) -> AngularRate {
        self.zero_rate().map_or(AngularRate::ZERO, ZeroRate::bias)
    }

    /// Returns the residual bias when driving and its sigma, rad/s; 0 without zero-rate updates.
    pub fn bias_when_driving(&self) -> [f32; 2] {
        self.zero_rate().map_or([0.0; 2], ZeroRate::when_driving)
    }

    /// Returns what standstills and turns have shown of the vertical beyond the configured mounting, if it is estimated.
    pub fn vertical(&self) -> Option<&Vertical> {
        self.state.initialised.as_ref()?.level.vertical()
    }

    fn judged(&self, standing: Standing) -> Standing {
        match self.zero_rate() {
            Some(known) if known.contradicted() => Standing { is_contradicted: true, ..Standing::UNKNOWN },
            Some(known) if known.is_refused() => Standing::UNKNOWN,
            _ => standing,
        }
    }

    fn zero_rate(&self) -> Option<&ZeroRate> {
        self.state.initialised.as_ref()?.zero_rate.as_ref()
    }

    fn zero_rate_mut(&mut self) -> Option<&mut ZeroRate> {
        self.state.initialised.as_mut()?.zero_rate.as_mut()
    }

    /// Levels a sample and returns the gyro's reading at rest; does nothing and returns `None` before initialisation.
    fn level(&mut self, sample: &mut ImuSample, standing: Standing) -> Option<ZeroPoint> {
        let stands = self.judged(standing).is_likely();
        let known = self.state.initialised.as_mut()?;
        if known.level.add(sample, stands) {
            known.zero = known.level.zero(self.config.earth_rate);
        }
        *sample = known.level.rotation.sample(sample);
        Some(known.zero)
    }

    fn refuse(&mut self, error: AlignError) {
        if let AlignError::Jump { .. } = error {
            count(&mut self.state.counters.clock_jumps, 1);
            self.state.static_init.restart();
            let State { tick, silent, .. } = self.state;
            self.lose(tick.wrapping_sub(silent), MAX_GAP.max(silent));
        } else {
            count(&mut self.state.counters.misplaced, 1);
        }
        // The refused sample may be the only one of its step, so it counts as a gap.
        if !matches!(error, AlignError::Duplicate { .. }) {
            self.gap(u32::MAX);
        }
    }

    /// Notes that the sensor's clock has lost this time, microseconds: the next step ends a gap.
    pub(crate) fn lose_time(&mut self, lost: u64) {
        let steps = (lost.saturating_add(PERIOD_US / 2) / PERIOD_US).min(u64::from(u16::MAX)) as u32;
        count(&mut self.state.counters.missing, steps);
        self.lose(self.state.tick, steps);
        self.gap(u32::MAX);
    }

    /// Notes that the gap in the yaw that ends after a tick is longer than the grid shows.
    fn lose(&mut self, after: u32, steps: u32) {
        self.state.live_yaw.lose(after, steps);
        self.state.delayed_yaw.lose(after, steps);
    }

    /// Notes that samples are missing. What they hide while the vehicle starts is little where they are few.
    fn gap(&mut self, missing: u32) {
        self.state.gap_within = WINDOW as u32;
        self.state.windows.break_off();
        if let Some(known) = &mut self.state.initialised {
            self.state.standstill.restart();
            known.zero_rate.as_mut().map(ZeroRate::restart);
            known.level.restart();
        } else if missing > BRIDGED {
            self.state.static_init.restart();
        }
    }

    /// Drops the current window and static initialisation, because neither may span a sample that is not good.
    fn break_window(&mut self) {
        self.state.windows.break_off();
        if self.state.initialised.is_none() {
            self.state.static_init.restart();
        }
    }

    /// Applies the estimate that is due at this tick; counts one that did not arrive in time.
    fn use_estimate(&mut self, tick: u32) -> Option<Implausible> {
        let State { windows, compensator, counters, .. } = &mut self.state;
        let Some(estimate) = windows.take_estimate(tick, self.config.compensate.stride.delay())? else {
            count(&mut counters.late, 1);
            (windows.accepted, windows.faults) = (false, Faults::LATE);
            return None;
        };
        count(&mut counters.windows, 1);
        count(&mut counters.clamped_inputs, u32::from(estimate.clamped_inputs));
        match compensator.revise(&estimate) {
            Ok(()) => {
                (windows.accepted, windows.faults) = (true, Faults::NONE);
                None
            }
            Err(implausible) => {
                count(&mut counters.implausible, 1);
                (windows.accepted, windows.faults) = (false, Faults::IMPLAUSIBLE);
                Some(implausible)
            }
        }
    }

    #[inline(never)]
    fn estimate_rates(&mut self, frame: &Frame, zero: &ZeroPoint, standing: Standing, drives: bool) -> Rates {
        let sample = &frame.sample;
        let rates = zero.less(sample.angular_rate);
        let features = window::features(sample.specific_force, rates);
        let [.., rate] = rates;
        let good = sample.validity.is_good();
        self.state.compensator.add(frame.tick, rates, sample.validity);
        if good {
            self.state.windows.add(features);
        }
        let complete = self.state.compensator.complete();
        self.update_bias(complete.as_ref(), good.then_some(rate), standing);
        self.claim_again(sample, rates, standing, drives);
        let remaining = self.remaining();
        let stands = self.state.stood as usize > self.config.compensate.lag.samples();
        let live = self.state.compensator.live(remaining, self.state.stood > 0);
        let delayed = self.state.compensator.delayed(remaining, stands);
        Rates { live, delayed, complete, early_sigma: None }
    }

    fn update_bias(&mut self, complete: Option<&Complete>, rate: Option<AngularRate>, standing: Standing) {
        let State { initialised, compensator, stood, counters, sensor_bias, course, .. } = &mut self.state;
        let zero_rate = initialised.as_mut().and_then(|known| known.zero_rate.as_mut());
        let (Some(zero_rate), Some(complete)) = (zero_rate, complete) else { return };
        course.add(zero_rate.filter(), complete.tick, complete.valid_left(), standing.is_likely());
        if course.take_has_taught()
            && let Some(variance) = zero_rate.warmed(sensor_bias.change_sigma)
        {
            course.widen(variance);
            sensor_bias.refer();
        }
        match zero_rate.observe(complete.left(), standing, sensor_bias.change_sigma) {
            Some(ZeroRateOutcome::Used) => {
                count(&mut counters.zero_rate_updates, 1);
                sensor_bias.refer();
            }
            Some(ZeroRateOutcome::Refused) => count(&mut counters.contradicted, 1),
            Some(ZeroRateOutcome::Waits) | None => {}
        }
        if rate.is_some_and(|rate| zero_rate.contradicts_wheels(rate)) {
            count(&mut counters.contradicted, 1);
        }
        if zero_rate.stands() {
            *stood = stood.saturating_add(1);
        } else if core::mem::take(stood) > 0 {
            compensator.end_standstill();
        }
    }
}
