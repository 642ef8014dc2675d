//! The coprocessor takes readings, CAN frames and time, and returns CAN frames, windows for the networks and
//! observations.
//!
//! [`Coprocessor`] defines the order in which the parts of the product run, and does no input or output itself. The
//! firmware image, a replay of a recorded drive, the fault harness and your own board are adapters around it, so all
//! of them run the same code. It owns the monitor of the inertial sensor, the pipeline, the wheels, the pipeline of
//! the fibre-optic gyro, the message encoders, and the rule for late windows.
//!
//! Use it in this order:
//!
//! 1. Pass in the inputs that have arrived: [`Coprocessor::imu`], [`Coprocessor::fog`], [`Coprocessor::can`]. Call
//!    [`Coprocessor::poll`] about every millisecond, because it detects a silent sensor. The frames go to the
//!    [`Sink`] that each call gets.
//! 2. Run the windows of [`Coprocessor::window`] and [`Coprocessor::fog_window`] through the networks, at once or in
//!    a task of lower priority, and pass the estimates to [`Coprocessor::deliver`] and [`Coprocessor::deliver_fog`].
//!
//! A window's estimate is used [`crate::compensate::Mode::delay`] samples after the window, however early it arrives,
//! so the frames do not depend on the speed of the machine. If samples arrive faster than 100 times a second,
//! [`Coprocessor::is_ready`] tells when the next one has to wait for an estimate.

mod config;
mod handover;
mod sink;
mod timeline;

pub use crate::pipeline::DueWindow;
pub use config::{Clock, Config, InputError, StorageFaults};
pub use sink::{Sink, TimedFrame};

use crate::bias::{Latitude, StaticError};
use crate::can::DataFrame;
use crate::can::encoder::CanEncoder;
use crate::can::fog_encoder::FogEncoder;
use crate::can::latitude::LatitudeReceiver;
use crate::can::wheel::WheelReceiver;
use crate::compensate::Settled;
use crate::estimate::VehicleSample;
use crate::fog::{FogCounters, FogPipeline};
use crate::health::{BoardFaults, InputCounters, MonitorCounters, count};
use crate::model::Estimate;
use crate::model::fognet::FogEstimate;
use crate::model::seconds::SecondsWindow;
use crate::monitor::{SensorMonitor, TIMEOUT_US};
use crate::pipeline::Pipeline;
use crate::sample::{FogSample, ImuSample, WheelSample};
use crate::units::{CentiCelsius, Micros};
use handover::Handover;
use timeline::Timeline;

/// The results of one sample, or of its absence, for a log or diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// The sample with its validity; `None` where the sensor is silent.
    pub sample: Option<ImuSample>,
    /// Everything that is sent for the sample.
    pub vehicle: VehicleSample,
    /// The newest report of the wheels.
    pub wheels: WheelSample,
    /// The sample whose estimate is final with this one.
    pub settled: Option<Settled>,
    /// The reason why static initialisation was refused with this sample.
    pub refused: Option<StaticError>,
}

/// The state of the bus, as the caller reports it.
#[derive(Debug, Clone, Copy)]
struct Bus {
    lost: u32,
    is_off: bool,
    /// The number of lost frames that the messages have reported.
    reported: u32,
}

/// Runs the coprocessor of one vehicle.
#[derive(Debug, Clone)]
pub struct Coprocessor {
    clock: Clock,
    storage: StorageFaults,
    bus: Bus,
    timeline: Timeline,
    monitor: SensorMonitor,
    pipeline: Pipeline,
    handover: Handover,
    wheels: Option<WheelReceiver>,
    /// The newest report of the wheels.
    known_wheels: Option<WheelSample>,
    fog: FogPipeline,
    latitude: Option<LatitudeReceiver>,
    encoder: CanEncoder,
    fog_encoder: FogEncoder,
    /// The newest sample's time stamp, and the time at which it arrived.
    sample_time: Micros,
    heard: Micros,
    /// The newest temperature: some parts send it with one sample in a hundred.
    temperature: Option<CentiCelsius>,
    /// Rates are withheld.
    paused: bool,
    counters: InputCounters,
}

impl Coprocessor {
    /// The initial value for a static: the default configuration at time 0. Configure it before the first input. It
    /// is about 10 KB, which [`Coprocessor::new`] would return on the stack.
    pub const START: Self = {
        const CONFIG: Config = Config::DEFAULT;
        Self {
            clock: CONFIG.clock,
            storage: CONFIG.storage,
            bus: Bus { lost: 0, is_off: false, reported: 0 },
            timeline: Timeline::START,
            monitor: SensorMonitor::new(CONFIG.clock_ratio),
            handover: Handover::new(CONFIG.has_gyronet, CONFIG.pipeline.compensate.mode.delay()),
            pipeline: Pipeline::new(CONFIG.pipeline),
            wheels: CONFIG.wheels,
            known_wheels: None,
            fog: FogPipeline::new(CONFIG.fog, CONFIG.has_fognet),
            latitude: None,
            encoder: CanEncoder::START,
            fog_encoder: FogEncoder::new(CONFIG.fog_ids),
            sample_time: Micros(0),
            heard: Micros(0),
            temperature: None,
            paused: false,
            counters: InputCounters::NONE,
        }
    };

    /// Creates a coprocessor before its first input, at time 0.
    #[must_use]
    pub fn new(config: Config) -> Self {
        let mut coprocessor = Self::START;
        coprocessor.configure(&config);
        coprocessor
    }

    /// Sets the configuration of [`Coprocessor::START`], once and before the first input.
    #[inline(never)]
    pub fn configure(&mut self, config: &Config) {
        self.clock = config.clock;
        self.storage = config.storage;
        self.monitor = SensorMonitor::new(config.clock_ratio.filter(|_| config.clock == Clock::Outside));
        self.handover = Handover::new(config.has_gyronet, config.pipeline.compensate.mode.delay());
        self.pipeline.configure(config.pipeline);
        self.wheels = config.wheels;
        self.fog.configure(config.fog, config.has_fognet);
        self.latitude = config.latitude;
        if config.fog_expected {
            self.fog.start_without_sample(Micros(0));
        }
        self.encoder = CanEncoder::new(config.can);
        self.fog_encoder = FogEncoder::new(config.fog_ids);
    }

    /// Processes a sample of the inertial sensor that arrived at `now`; its frames go to `sink`.
    ///
    /// # Errors
    /// [`InputError::Imu`] when its time stamp has no place on the grid, [`InputError::ClockWentBack`]. The sample is
    /// counted and not used, and no frame is sent for it; the samples that follow report a gap.
    pub fn imu(
        &mut self,
        sample: ImuSample,
        now: Micros,
        sink: &mut impl Sink,
    ) -> Result<Observation, InputError> {
        let observation = self.take_imu(sample, now, sink);
        if observation.is_ok() {
            self.step_fog(sink);
        }
        observation
    }

    /// Not inlined, so that its stack frame is gone when the fibre-optic gyro steps.
    #[inline(never)]
    fn take_imu(
        &mut self,
        sample: ImuSample,
        now: Micros,
        sink: &mut impl Sink,
    ) -> Result<Observation, InputError> {
        let now = self.advance(now)?;
        self.sample_time = sample.time;
        if let Some(wheels) = self.poll_wheels() {
            self.pipeline.wheels(wheels);
        }
        self.temperature = sample.temperature.or(self.temperature);
        let validity = self.monitor.judge(&sample);
        let sample = ImuSample { validity, temperature: self.temperature, ..sample };
        self.report_board();
        let output = self.pipeline.correct(sample).map_err(InputError::Imu)?;
        self.monitor.heard(sample.time, now);
        self.heard = now;
        self.send(&output.vehicle, sample.time, sink);
        if let Some(window) = output.window {
            let replaced = self.handover.offer(window, now);
            count(&mut self.counters.replaced_windows, u32::from(replaced));
        }
        let (settled, refused) = (output.settled, output.refused);
        let wheels = self.known_wheels.unwrap_or_default();
        Ok(Observation { sample: Some(sample), vehicle: output.vehicle, wheels, settled, refused })
    }

    /// Counts an input of the inertial sensor that was not a valid sample.
    pub fn imu_error(&mut self) {
        count(&mut self.counters.imu_errors, 1);
    }

    /// Processes a sample of the fibre-optic gyro that arrived at `now`; the frames of the steps that it completes go
    /// to `sink`.
    ///
    /// # Errors
    /// [`InputError::Fog`] when it is a duplicate or out of order, [`InputError::ClockWentBack`]; the sample is
    /// counted and not used.
    pub fn fog(&mut self, sample: FogSample, now: Micros, sink: &mut impl Sink) -> Result<(), InputError> {
        self.advance(now)?;
        let added = self.fog.add(self.time(), sample).map_err(InputError::Fog);
        self.step_fog(sink);
        added
    }

    /// Counts an input of the fibre-optic gyro that was not a valid sample.
    pub fn fog_error(&mut self) {
        count(&mut self.counters.fog_errors, 1);
    }

    /// Processes a frame received from the bus at `now`. Frames with neither a wheel speed nor a latitude are
    /// ignored.
    ///
    /// # Errors
    /// [`InputError::Wheels`] when a wheel frame is corrupt or marks a speed as invalid, [`InputError::Latitude`],
    /// [`InputError::ClockWentBack`]; the error is counted. Without a valid frame the wheels become silent after a
    /// while, which is reported; the latitude in use is kept.
    pub fn can(&mut self, frame: &DataFrame, now: Micros) -> Result<(), InputError> {
        self.advance(now)?;
        let time = self.time();
        match self.wheels.as_mut().and_then(|wheels| wheels.decode(frame, time)) {
            Some(Err(error)) => {
                count(&mut self.counters.wheel_errors, 1);
                Err(InputError::Wheels(error))
            }
            Some(Ok(_)) | None => self.take_latitude(frame, time),
        }
    }

    fn take_latitude(&mut self, frame: &DataFrame, time: Micros) -> Result<(), InputError> {
        let Some(receiver) = &mut self.latitude else { return Ok(()) };
        let received = receiver.decode(frame, time);
        self.fog.contest_latitude(receiver.is_contested());
        match received.transpose() {
            Ok(received) => {
                if let Some((received, latitude)) =
                    received.and_then(|received| Some((received, Latitude::from_degrees(received.degrees)?)))
                {
                    self.fog.set_latitude(latitude, received.moved);
                }
                Ok(())
            }
            Err(error) => {
                count(&mut self.counters.latitude_errors, 1);
                Err(InputError::Latitude(error))
            }
        }
    }

    /// Does the work that is due at `now` without an input: it sends the messages of silent sensors to `sink`.
    ///
    /// # Errors
    /// [`InputError::ClockWentBack`]; the error is counted.
    pub fn poll(&mut self, now: Micros, sink: &mut impl Sink) -> Result<Option<Observation>, InputError> {
        let now = self.advance(now)?;
        let observation = self.monitor.poll(now).map(|steps| {
            self.report_board();
            let vehicle = self.pipeline.silent(steps);
            self.send(&vehicle, Micros(self.sample_time.0.saturating_add(now.0 - self.heard.0)), sink);
            let wheels = self.poll_wheels().unwrap_or_default();
            Observation { sample: None, vehicle, wheels, settled: None, refused: None }
        });
        self.step_fog(sink);
        Ok(observation)
    }

    /// Returns whether the next sample of the inertial sensor can be processed at `now`. If not, the sample needs an
    /// estimate that is still being computed: leave it in its buffer. The sensor does not count as silent meanwhile.
    pub fn is_ready(&mut self, now: Micros) -> bool {
        let now = self.timeline.at(now);
        let waits = self.handover.must_wait(self.pipeline.tick(), now);
        if waits {
            self.monitor.hold(now);
        }
        !waits
    }

    /// Returns the window that is due for GyroNet, once.
    pub fn window(&mut self) -> Option<DueWindow> {
        self.handover.take()
    }

    /// Accepts GyroNet's estimate of the window that ended with sample `end`.
    ///
    /// # Errors
    /// [`InputError::NoWindow`] when no window waits for the estimate: it is too late, or the window never existed.
    /// It is counted and not used.
    pub fn deliver(&mut self, end: u32, estimate: Estimate) -> Result<(), InputError> {
        let wanted = self.handover.close(end) && self.pipeline.deliver(end, estimate);
        self.claim(wanted, end)
    }

    /// Returns the window that is due for FoGNet and its number, once.
    pub fn fog_window(&mut self) -> Option<(u32, SecondsWindow<'_>)> {
        self.fog.window()
    }

    /// Accepts FoGNet's estimate of a window.
    ///
    /// # Errors
    /// [`InputError::NoWindow`], as [`Coprocessor::deliver`].
    pub fn deliver_fog(&mut self, number: u32, estimate: FogEstimate) -> Result<(), InputError> {
        let wanted = self.fog.deliver(number, estimate);
        self.claim(wanted, number)
    }

    /// Notes that GyroNet's weights are corrupt: no window becomes due any more, and the messages report it.
    pub fn weights_damaged(&mut self) {
        self.handover.stop();
    }

    /// Notes that FoGNet's weights have been erased or no longer match their checksum. Later rates of the gyro are
    /// computed without FoGNet and report that.
    pub fn fognet_unavailable(&mut self) {
        self.fog.fognet_unavailable();
    }

    /// Notes that the sensor was moved since earlier drives. The next messages report it.
    pub fn mount_moved(&mut self) {
        self.pipeline.mount_moved();
    }

    /// Notes the number of frames lost on the bus since the start, and whether the controller is off the bus. The next
    /// messages report it.
    pub fn bus(&mut self, lost: u32, is_off: bool) {
        self.bus = Bus { lost, is_off, ..self.bus };
    }

    /// Returns the pipeline, to read its state.
    #[must_use]
    pub fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    /// Returns the fault counters of the sensor monitor.
    #[must_use]
    pub fn monitor_counters(&self) -> &MonitorCounters {
        self.monitor.counters()
    }

    /// Returns the event counters of the fibre-optic gyro.
    #[must_use]
    pub fn fog_counters(&self) -> &FogCounters {
        self.fog.counters()
    }

    /// Withholds the rates, or sends them again. The first call that withholds them sends a message set without a
    /// rate, and so does each later sample. The caller does this before it stops sending to erase flash.
    pub fn pause(&mut self, paused: bool, sink: &mut impl Sink) {
        let begins = paused && !self.paused;
        self.paused = paused;
        if begins {
            let vehicle = self.pipeline.silent(0);
            self.send(&vehicle, self.sample_time, sink);
        }
    }

    /// Returns the counters of inputs that were refused or replaced.
    #[must_use]
    pub fn input_counters(&self) -> &InputCounters {
        &self.counters
    }

    fn advance(&mut self, now: Micros) -> Result<Micros, InputError> {
        self.timeline.advance(now).map_err(|by| {
            count(&mut self.counters.clock_back, 1);
            InputError::ClockWentBack { by }
        })
    }

    /// Returns the time that is used for the wheels, the latitude and the fibre-optic gyro.
    fn time(&self) -> Micros {
        match self.clock {
            Clock::Outside => self.timeline.now(),
            Clock::Sensor => self.sample_time.min(timeline::END),
        }
    }

    fn poll_wheels(&mut self) -> Option<WheelSample> {
        let time = self.time();
        self.known_wheels = self.wheels.as_mut().and_then(|wheels| wheels.poll(time));
        self.known_wheels
    }

    /// Sends the rates of the fibre-optic gyro's steps that are complete or due.
    #[inline(never)]
    fn step_fog<SINK: Sink>(&mut self, sink: &mut SINK) {
        let time = self.time();
        while self.fog.is_due(time) {
            let wheels = self.poll_wheels();
            let silent = self.timeline.now().0.saturating_sub(self.heard.0) >= TIMEOUT_US;
            let fresh = self.clock == Clock::Sensor || !silent;
            let inertial = self.pipeline.inertial().filter(|_| fresh);
            let Some(estimate) = self.fog.next_step(time, inertial, wheels.as_ref()) else { return };
            sink.fog_rate(&estimate);
            let time = self.sample_time;
            if SINK::TAKES_FRAMES {
                self.fog_encoder.send(&estimate, |frame| sink.frame(TimedFrame { frame, time }));
            }
        }
    }

    fn report_board(&mut self) {
        let stored = self.storage.damaged || !self.handover.has_network();
        let configuration_lost = self.storage.configuration_lost;
        let bus = self.bus.is_off || self.bus.lost != self.bus.reported;
        let clock = self.monitor.is_clock_off();
        self.pipeline.board(BoardFaults { bus, clock, stored, configuration_lost });
        self.pipeline.set_clock_ratio(self.monitor.clock_ratio());
    }

    fn send<SINK: Sink>(&mut self, vehicle: &VehicleSample, time: Micros, sink: &mut SINK) {
        let withheld = self.paused.then(|| self.pipeline.silent(0));
        if SINK::TAKES_FRAMES {
            let vehicle = withheld.as_ref().unwrap_or(vehicle);
            self.encoder.send(vehicle, |frame| sink.frame(TimedFrame { frame, time }));
            if let Some(frame) = self.encoder.status(|| self.pipeline.status()) {
                sink.frame(TimedFrame { frame, time });
            }
            self.counters.out_of_range = self.encoder.out_of_range();
        }
        self.bus.reported = self.bus.lost;
    }

    fn claim(&mut self, wanted: bool, end: u32) -> Result<(), InputError> {
        count(&mut self.counters.unclaimed_estimates, u32::from(!wanted));
        if wanted { Ok(()) } else { Err(InputError::NoWindow { end }) }
    }
}
