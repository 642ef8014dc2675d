//! The coprocessor takes readings, CAN frames and time, and returns CAN frames, windows for the networks and
//! observations. It does no input or output: the firmware, a replay, the simulated situations and your own board are
//! adapters around it.
//!
//! 1. Pass in the inputs that have arrived: [`Coprocessor::imu`], [`Coprocessor::fog`], [`Coprocessor::can`]. Call
//!    [`Coprocessor::poll`] about every millisecond, because it detects a silent sensor. The frames go to the [`Sink`]
//!    that each call gets.
//! 2. Run the windows of [`Coprocessor::window`] through the network, at once or in a task of lower priority, and pass
//!    the estimates to [`Coprocessor::deliver`].
//!
//! An estimate is used [`crate::compensate::Stride::delay`] samples after its window, however early it arrives, so the
//! frames do not depend on the machine's speed. If samples arrive faster than 100 times a second,
//! [`Coprocessor::is_ready`] tells when the next one has to wait for an estimate.

mod clock;
mod config;
mod second_source;
mod sink;
mod step;

pub use crate::pipeline::DueWindow;
pub use clock::Clock;
pub use config::{Config, InputError, StorageFaults};
pub use sink::{Sink, TimedFrame};
pub use step::{Bus, MAX_SAMPLES, QueuedCan, Step};

use crate::bias::{Latitude, StaticError};
use crate::can::DataFrame;
use crate::can::encoder::CanEncoder;
use crate::can::fog_encoder::FogEncoder;
use crate::can::wheel::WheelReceiver;
use crate::compensate::Complete;
use crate::estimate::{VehicleSample, YawEstimate};
use crate::fog::{Beside, FogConfig, FogCounters, FogPipeline};
use crate::heading::{CourseState, Fix, Heading, HeadingError, HeadingReceiver, Received, Refusal};
use crate::health::slow::SlowStatus;
use crate::health::{BoardFaults, Faults, InputCounters, MonitorCounters, Quality, Source, count};
use crate::model::Estimate;
use crate::monitor::{SensorMonitor, TIMEOUT_US};
use crate::mounting::Vertical;
use crate::pipeline::{self, BoardState, Handover, Pipeline};
use crate::sample::{FogSample, Frame, ImuSample, NO_STAMP, WheelSample};
use crate::standstill::Standing;
use crate::units::{AngularRate, CentiCelsius, Micros, SpecificForce};
use clock::Timeline;
pub use second_source::Contradiction;
use second_source::{Doubts, SecondSource, Shown};

/// Silence of a configured source of courses that is a trouble, and the time that its start may take.
const COURSE_SILENCE_US: u64 = 10_000_000;
const FIRST_COURSE_US: u64 = 60_000_000;

/// The results of one sample, or of its absence, for a log or diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// The sample with its validity; `None` where the sensor is silent.
    pub sample: Option<ImuSample>,
    /// Everything that is sent for the sample.
    pub vehicle: VehicleSample,
    /// The newest report of the wheels.
    pub wheels: WheelSample,
    /// The judgement of standstill.
    pub standing: Standing,
    /// The sample whose estimate is final with this one.
    pub complete: Option<Complete>,
    /// The reason why static initialisation was refused with this sample.
    pub refused: Option<StaticError>,
    /// The vertical by standstills and turns, in the sensor's axes, where this sample has changed it.
    pub vertical: Option<Vertical>,
}

#[derive(Debug, Clone, Copy)]
struct BusState {
    lost: u32,
    is_off: bool,
    /// The number of lost frames that the messages have reported.
    reported: u32,
}

/// Runs the coprocessor of one vehicle.
#[derive(Debug, Clone)]
pub struct Coprocessor {
    storage: StorageFaults,
    bus: BusState,
    timeline: Timeline,
    monitor: SensorMonitor,
    pipeline: Pipeline,
    handover: Handover,
    wheels: Option<WheelReceiver>,
    fog: FogPipeline,
    heading: Option<HeadingReceiver>,
    /// Time from which the receiver of courses counts as silent, once the clock is known.
    heading_due: Option<Micros>,
    second: SecondSource,
    /// The newest usable rates of the inertial gyro, with its expected error, and of the fibre-optic one, rad/s.
    inertial_rate: Option<(Micros, [f32; 2])>,
    fog_rate: Option<f32>,
    encoder: CanEncoder,
    fog_encoder: FogEncoder,
    /// The newest temperature: some parts send it with one sample in a hundred.
    temperature: Option<CentiCelsius>,
    paused: bool,
    counters: InputCounters,
}

impl Coprocessor {
    /// Creates a coprocessor at time 0. It is about 10 KB: on a board with a small stack make it in a static.
    #[inline]
    pub const fn new(config: Config) -> Self {
        let clock_is_exact = config.clock_is_exact && matches!(config.clock, Clock::Outside);
        Self {
            storage: config.storage,
            bus: BusState { lost: 0, is_off: false, reported: 0 },
            timeline: Timeline::new(config.clock),
            monitor: SensorMonitor::new(clock_is_exact),
            handover: Handover::new(config.has_gyronet, config.pipeline.compensate.stride.delay()),
            pipeline: Pipeline::new(config.pipeline),
            wheels: config.wheels,
            fog: FogPipeline::new(FogConfig { clock_is_exact, ..config.fog }, config.fog_expected),
            heading: config.heading,
            heading_due: None,
            second: SecondSource::START,
            inertial_rate: None,
            fog_rate: None,
            encoder: CanEncoder::new(config.can),
            fog_encoder: FogEncoder::new(config.fog_ids),
            temperature: None,
            paused: false,
            counters: InputCounters::NONE,
        }
    }

    /// Processes a sample of the inertial sensor that arrived at `now`, and returns the newest step of 10 ms that it
    /// completes. Frames and observations of all that it completes go to `sink`; those that wait for an estimate
    /// follow with [`Coprocessor::poll`]. An error (its stamp, the rate, [`InputError::ClockWentBack`]) is counted,
    /// and a gap reported.
    pub fn imu(
        &mut self,
        sample: ImuSample,
        now: Micros,
        sink: &mut impl Sink,
    ) -> Result<Option<Observation>, InputError> {
        let mut newest = None;
        self.take(sample, now, sink, &mut newest).map(|()| newest)
    }

    /// [`Self::imu`] whose observations go to the sink alone.
    pub fn imu_to(&mut self, sample: ImuSample, now: Micros, sink: &mut impl Sink) -> Result<(), InputError> {
        self.take(sample, now, sink, &mut None)
    }

    /// [`Self::imu`] that writes the observation in place: a copy of it is a large part of a small stack.
    fn take(
        &mut self,
        sample: ImuSample,
        now: Micros,
        sink: &mut impl Sink,
        newest: &mut Option<Observation>,
    ) -> Result<(), InputError> {
        let added = self.add(sample, now, sink, newest);
        self.step_fog(sink);
        added
    }

    fn add(
        &mut self,
        sample: ImuSample,
        now: Micros,
        sink: &mut impl Sink,
        newest: &mut Option<Observation>,
    ) -> Result<(), InputError> {
        let now = self.advance(now)?;
        let sample = ImuSample { time: if sample.time == NO_STAMP { now } else { sample.time }, ..sample };
        self.timeline.sample = sample.time;
        if !self.timeline.is_sensors() {
            let lost = self.monitor.arrives(sample.time, now);
            if lost > 0 {
                self.pipeline.lose_time(lost);
            }
        }
        self.temperature = sample.temperature.or(self.temperature);
        while let Some(frame) = self.pipeline.next_frame() {
            self.correct(frame, now, sink, newest);
        }
        self.pipeline.add(sample).map_err(InputError::Imu)?;
        // The caller has seen that the first one is ready.
        if let Some(first) = self.pipeline.next_frame() {
            self.correct(first, now, sink, newest);
        }
        self.correct_ready(now, sink, newest);
        self.monitor.heard(sample.time, now);
        Ok(())
    }

    /// Corrects the steps that need no estimate that is still being computed.
    fn correct_ready(&mut self, now: Micros, sink: &mut impl Sink, newest: &mut Option<Observation>) {
        while self.pipeline.has_piece()
            && !self.handover.must_wait(self.pipeline.tick(), now)
            && let Some(frame) = self.pipeline.next_frame()
        {
            self.correct(frame, now, sink, newest);
        }
    }

    // Not inlined, so that its large frame is gone before the step of the fibre-optic gyro.
    #[inline(never)]
    fn correct(
        &mut self,
        mut frame: Frame,
        now: Micros,
        sink: &mut impl Sink,
        newest: &mut Option<Observation>,
    ) {
        let wheels = self.poll_wheels();
        frame.sample.validity = self.monitor.judge(&frame.sample);
        frame.sample.temperature = self.temperature;
        let sample = frame.sample;
        let board = self.board_state();
        let mut output = self.pipeline.step(frame, wheels.as_ref(), &board);
        if output.standing.is_likely() {
            self.monitor.settle();
        }
        let late = self.monitor.late;
        // At fewer than 100 samples a second a step waits for the sample that completes it, at more for the next but one.
        let waited = self.timeline.sample.0.saturating_sub(sample.time.0).min(u64::from(u32::MAX)) as u32;
        if late > 0 || waited > 0 {
            output.vehicle.come_late(late.saturating_add(waited), u64::from(late) > TIMEOUT_US);
        }
        self.send(&output.vehicle, sample.time, sink);
        if let Some(window) = &output.window {
            let replaced = self.handover.offer(window, now);
            count(&mut self.counters.replaced_windows, u32::from(replaced));
        }
        let rate = Some(output.vehicle.live).filter(|live| live.source != Source::Raw).map(rad_per_sec);
        let [_, lateral, _] = output.vehicle.specific_force;
        // A rate without an expected error contradicts nothing.
        let sigma = output.vehicle.live.sigma.map(|sigma| sigma.0 as f32 / AngularRate::PER_RAD_PER_SEC);
        self.inertial_rate = rate.zip(sigma).map(|(rate, sigma)| (self.timeline.time(), [rate, sigma]));
        self.second.add(&Shown {
            inertial: rate,
            fog: self.fog_rate,
            confirms_fog: self.fog.is_confirmed,
            lateral: lateral.0 as f32 / SpecificForce::PER_METRE_PER_SEC2,
            wheels: wheels.as_ref().and_then(second_source::axle),
        });
        if self.second.confirms_fog {
            self.fog.confirm();
        }
        let pipeline::Output { standing, complete, refused, vertical, .. } = output;
        let wheels = wheels.unwrap_or_default();
        sink.observed(newest.insert(Observation {
            sample: Some(sample),
            vehicle: output.vehicle,
            wheels,
            standing,
            complete,
            refused,
            vertical,
        }));
    }

    /// Counts an input of the inertial sensor that was not a valid sample.
    pub fn imu_error(&mut self) {
        count(&mut self.counters.imu_errors, 1);
    }

    /// Processes a sample of the fibre-optic gyro; one that is a duplicate or out of order is an error, and counted.
    pub fn fog(&mut self, sample: FogSample, now: Micros, sink: &mut impl Sink) -> Result<(), InputError> {
        self.advance(now)?;
        let added = self.fog.add(self.timeline.time(), sample).map_err(InputError::Fog);
        self.step_fog(sink);
        added
    }

    /// Counts an input of the fibre-optic gyro that was not a valid sample.
    pub fn fog_error(&mut self) {
        count(&mut self.counters.fog_errors, 1);
    }

    /// Processes a frame received from the bus at `now`; returns whether it is used: for wheel speeds, a course or the
    /// latitude. An error is counted; without valid wheel frames the wheels become silent, which is reported.
    pub fn can(&mut self, frame: &DataFrame, now: Micros) -> Result<bool, InputError> {
        self.advance(now)?;
        let time = self.timeline.time();
        match self.wheels.as_mut().and_then(|wheels| wheels.decode(frame, time)) {
            Some(Err(error)) => {
                count(&mut self.counters.wheel_errors, 1);
                Err(InputError::Wheels(error))
            }
            wheels => Ok(self.take_heading(frame, time)? || wheels.is_some()),
        }
    }

    /// Processes a course over ground that arrived at `now`, up to two seconds after its time. One that can be no
    /// vehicle's ([`InputError::Heading`]) is counted and not used.
    pub fn heading(&mut self, heading: &Heading, now: Micros) -> Result<(), InputError> {
        self.advance(now)?;
        let checked = heading.checked().map_err(|error| self.refuse_heading(error))?;
        self.pipeline.course(&checked);
        Ok(())
    }

    /// Processes a message of a GNSS receiver on a line of its own ([`crate::heading::GnssLine`]), where one is
    /// configured. A damaged message, values outside a vehicle's range (a good course is used all the same) and a
    /// course by the receiver's own sensors are errors, which are counted.
    pub fn gnss(&mut self, fix: Result<Fix, HeadingError>, now: Micros) -> Result<(), InputError> {
        self.advance(now)?;
        let time = self.timeline.time();
        let receiver = self.heading.as_mut().filter(|receiver| receiver.settings().line.is_some());
        let Some(receiver) = receiver else { return Ok(()) };
        let received = fix.and_then(|fix| receiver.judge(fix, time));
        self.use_heading(received)
    }

    fn refuse_heading(&mut self, error: HeadingError) -> InputError {
        if error == HeadingError::Reckoned {
            self.pipeline.refuse_course(Refusal::Reckoned);
            return InputError::Heading(error);
        }
        let InputCounters { latitude_errors, heading_errors, .. } = &mut self.counters;
        let is_jump = matches!(error, HeadingError::Jump { .. });
        count(if is_jump { latitude_errors } else { heading_errors }, 1);
        InputError::Heading(error)
    }

    #[inline(never)]
    fn take_heading(&mut self, frame: &DataFrame, time: Micros) -> Result<bool, InputError> {
        let Some(receiver) = &mut self.heading else { return Ok(false) };
        let Some(received) = receiver.decode(frame, time) else { return Ok(false) };
        self.use_heading(received).map(|()| true)
    }

    fn use_heading(&mut self, received: Result<Received, HeadingError>) -> Result<(), InputError> {
        self.fog.contest_latitude(self.heading.as_ref().is_some_and(HeadingReceiver::is_contested));
        if matches!(received, Ok(Received { heading: Some(_), .. }) | Err(HeadingError::Reckoned)) {
            self.heading_due = Some(Micros(self.timeline.time().0.saturating_add(COURSE_SILENCE_US)));
        }
        let Received { heading, latitude } = received.map_err(|error| self.refuse_heading(error))?;
        if let Some(heading) = &heading {
            self.pipeline.course(heading);
        }
        let latitude = latitude.map_err(|error| self.refuse_heading(error))?;
        if let Some((latitude, is_near)) =
            latitude.and_then(|found| Some((Latitude::from_degrees(found.degrees)?, found.moved)))
        {
            self.fog.set_latitude(latitude, is_near);
        }
        Ok(())
    }

    /// Does what is due without an input: sets of silent sensors, and of steps that have waited for an estimate.
    pub fn poll(&mut self, now: Micros, sink: &mut impl Sink) -> Result<Option<Observation>, InputError> {
        let mut newest = None;
        self.poll_into(now, sink, &mut newest).map(|()| newest)
    }

    /// [`Self::poll`] whose observations go to the sink alone.
    pub fn poll_to(&mut self, now: Micros, sink: &mut impl Sink) -> Result<(), InputError> {
        self.poll_into(now, sink, &mut None)
    }

    /// [`Self::poll`] that writes the observation in place.
    fn poll_into(
        &mut self,
        now: Micros,
        sink: &mut impl Sink,
        newest: &mut Option<Observation>,
    ) -> Result<(), InputError> {
        let now = self.advance(now)?;
        if self.pipeline.has_piece() {
            self.correct_ready(now, sink, newest);
        }
        if let Some(steps) = self.monitor.poll(now) {
            let vehicle = self.pipeline.silent(steps, &self.board_state());
            self.send(&vehicle, self.monitor.time_at(now), sink);
            let wheels = self.poll_wheels().unwrap_or_default();
            let standing = Standing::UNKNOWN;
            sink.observed(newest.insert(Observation {
                sample: None,
                vehicle,
                wheels,
                standing,
                complete: None,
                refused: None,
                vertical: None,
            }));
        }
        // Not called in vain: its frame is large.
        if self.fog.is_due(self.timeline.time()) {
            self.step_fog(sink);
        }
        Ok(())
    }

    /// Returns whether the next sample of the inertial sensor can be processed at `now`. If not, the sample needs an
    /// estimate that is still being computed: leave it in its buffer. The sensor does not count as silent meanwhile.
    pub fn is_ready(&mut self, now: Micros) -> bool {
        let now = self.timeline.at(now);
        let waits = self.pipeline.is_step_due() && self.handover.must_wait(self.pipeline.tick(), now);
        if waits {
            self.monitor.hold(now);
        }
        !waits
    }

    /// Returns whether a step waits; if not, [`Coprocessor::poll`] has nothing to do for 20 ms after a sample.
    pub fn is_waiting(&self) -> bool {
        self.pipeline.has_piece() || self.fog.is_running()
    }

    /// Returns the window that is due for GyroNet, once.
    pub fn window(&mut self) -> Option<DueWindow> {
        self.handover.take()
    }

    /// Accepts the estimate of the window that ended with sample `end`, or counts it if none waits for it.
    pub fn deliver(&mut self, end: u32, estimate: Estimate) -> Result<(), InputError> {
        let wanted = self.handover.close(end) && self.pipeline.deliver(end, estimate);
        self.claim(wanted, end)
    }

    /// Notes that GyroNet's weights are corrupt: no window becomes due any more, and the messages report it.
    pub fn weights_damaged(&mut self) {
        self.handover.stop();
    }

    /// Notes that the sensor was moved since earlier drives. The next messages report it.
    pub fn mount_moved(&mut self) {
        self.pipeline.mount_moved();
    }

    /// Notes how many frames the bus has lost since the start, and whether the controller is off it, to report both.
    pub fn bus(&mut self, lost: u32, is_off: bool) {
        self.bus = BusState { lost, is_off, ..self.bus };
    }

    /// Returns the pipeline, to read its state.
    pub fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    /// Returns what courses have shown since the start, and whether their source is silent.
    pub fn course_state(&self) -> CourseState {
        let is_named = self.heading.as_ref().is_some_and(|receiver| receiver.settings().has_course());
        let is_silent = is_named && self.heading_due.is_some_and(|due| self.timeline.time() > due);
        CourseState { is_silent, ..self.pipeline.course_state() }
    }

    /// Returns the fault counters of the sensor monitor.
    pub fn monitor_counters(&self) -> &MonitorCounters {
        &self.monitor.counters
    }

    /// Returns the event counters of the fibre-optic gyro.
    pub fn fog_counters(&self) -> &FogCounters {
        &self.fog.counters
    }

    /// Withholds the rates, or sends them again. The first call that withholds them sends a message set without a
    /// rate, and so does each later sample. The caller does this before it stops sending to erase flash.
    pub fn pause(&mut self, paused: bool, sink: &mut impl Sink) {
        let begins = paused && !self.paused;
        self.paused = paused;
        if begins {
            let vehicle = self.pipeline.silent(0, &self.board_state());
            self.send(&vehicle, self.timeline.sample, sink);
        }
    }

    /// Returns the counters of inputs that were refused or replaced.
    pub fn input_counters(&self) -> &InputCounters {
        &self.counters
    }

    /// Returns what the sources showed when they last contradicted each other.
    pub fn contradiction(&self) -> &Contradiction {
        &self.second.contradiction
    }

    fn advance(&mut self, now: Micros) -> Result<Micros, InputError> {
        let now = self.timeline.advance(now).map_err(|by| {
            count(&mut self.counters.clock_back, 1);
            InputError::ClockWentBack { by }
        })?;
        // The sensor's clock is at 0 before its first sample.
        if self.heading_due.is_none()
            && let time @ Micros(1..) = self.timeline.time()
        {
            self.heading_due = Some(Micros(time.0.saturating_add(FIRST_COURSE_US)));
        }
        Ok(now)
    }

    fn poll_wheels(&mut self) -> Option<WheelSample> {
        let time = self.timeline.time();
        self.wheels.as_mut().and_then(|wheels| wheels.poll(time))
    }

    /// Sends the rates of the fibre-optic gyro's steps that are complete or due.
    #[inline(never)]
    fn step_fog<SINK: Sink>(&mut self, sink: &mut SINK) {
        let time = self.timeline.time();
        while self.fog.is_due(time) {
            let wheels = self.poll_wheels();
            let fresh = self.timeline.is_sensors() || !self.monitor.is_stale(self.timeline.now);
            let doubted = self.second.doubts().is_some_and(|doubts| doubts.inertial);
            let inertial_rate = self.inertial_rate.filter(|_| fresh && !doubted);
            let rate = inertial_rate.map(|(at, [rate, _])| (at, rate));
            let sigma = inertial_rate.map_or(0.0, |(_, [_, sigma])| sigma);
            let (tilted, leaning) = (self.pipeline.tilted(), self.pipeline.leaning());
            self.fog.beside(Beside { rate, sigma, tilted, leaning, scale: self.second.scale() });
            let Some(mut estimate) = self.fog.next_step(time, wheels.as_ref()) else { return };
            self.fog_rate = self.fog.shown;
            if self.second.doubts().is_some_and(|doubts| doubts.fog) && self.fog_rate.is_some() {
                estimate.quality = Quality::Degraded;
                estimate.faults = estimate.faults.with(Faults::IMPLAUSIBLE);
            }
            sink.fog_rate(&estimate);
            let time = self.timeline.sample;
            if SINK::TAKES_FRAMES {
                self.fog_encoder.send(&estimate, |frame| sink.frame(TimedFrame { frame, time }));
            }
        }
    }

    fn board_state(&self) -> BoardState {
        let stored = self.storage.damaged || !self.handover.has_network;
        let configuration_lost = self.storage.configuration_lost;
        let bus = self.bus.is_off || self.bus.lost != self.bus.reported;
        let clock = self.monitor.is_clock_off() || self.pipeline.is_rate_refused();
        let doubts = self.second.doubts().unwrap_or_default();
        let wheels = doubts.wheels || self.wheels.as_ref().is_some_and(WheelReceiver::is_invalid);
        let contradicted = doubts.inertial || self.monitor.shift() > 0.0;
        let faults = BoardFaults { bus, wheels, clock, contradicted, stored, configuration_lost };
        let shift = self.monitor.shift().max(self.monitor.suspect());
        BoardState { faults, clock_ratio: self.monitor.clock_ratio(), shift }
    }

    fn send<SINK: Sink>(&mut self, vehicle: &VehicleSample, time: Micros, sink: &mut SINK) {
        if self.paused {
            self.withhold(time, sink);
        } else {
            self.encode(vehicle, time, sink);
        }
        self.bus.reported = self.bus.lost;
    }

    #[inline(never)]
    fn withhold<SINK: Sink>(&mut self, time: Micros, sink: &mut SINK) {
        let vehicle = self.pipeline.silent(0, &self.board_state());
        self.encode(&vehicle, time, sink);
    }

    fn encode<SINK: Sink>(&mut self, vehicle: &VehicleSample, time: Micros, sink: &mut SINK) {
        if SINK::TAKES_FRAMES {
            self.encoder.send(vehicle, |frame| sink.frame(TimedFrame { frame, time }));
            let doubts = self.second.doubts().map(Doubts::bits);
            let Self { encoder, pipeline, wheels, timeline, fog, .. } = self;
            // One number for both yaws: a receiver sees that it changes.
            let gaps = |own: Option<u32>| match (own, fog.gaps()) {
                (Some(own), Some(fog)) => Some(own.wrapping_add(fog)),
                (own, fog) => own.or(fog),
            };
            let mut standstill = || Some(wheels.as_mut()?.poll(timeline.time())?.standstill);
            if let Some(frame) = encoder.status(|| {
                let status = pipeline.status(standstill());
                SlowStatus { doubts, gaps: gaps(status.gaps), ..status }
            }) {
                sink.frame(TimedFrame { frame, time });
            }
            self.counters.out_of_range = self.encoder.out_of_range;
        }
    }

    fn claim(&mut self, wanted: bool, end: u32) -> Result<(), InputError> {
        count(&mut self.counters.unclaimed_estimates, u32::from(!wanted));
        if wanted { Ok(()) } else { Err(InputError::NoWindow { end }) }
    }
}

fn rad_per_sec(estimate: YawEstimate) -> f32 {
    estimate.rate.0 as f32 / AngularRate::PER_RAD_PER_SEC
}
