//! The device is the board's side of the service line: it holds the stored data and answers requests.
//!
//! Some functions are kept out of their callers: what they have on the stack, requests, replies and
//! records, is then there only while they run.

mod stored;
mod weights;

pub use weights::MappedSlots;

use super::calibrate::{Calibrator, State, Task};
use super::conditions::Conditions;
use super::event::{EventKind, EventLog, SensorFault};
use super::frame::{Deframer, Frame, FrameError, emit};
use super::message::{
    AllCounters, Calibrate, FlashState, Identity, Info, LineCounters, Origin, PROTOCOL, Refusal, Reply,
    Request,
};
use super::standstill::StandstillGate;
use crate::can::wheel::WheelSettings;
use crate::health::{Faults, Status, count};
use crate::sample::{ImuSample, Standstill};
use crate::store::slots::{SlotError, WeightSource};
use crate::store::{Accepted, Calibration, Configuration, FogPart, ImuPart, Record, Store, Troubles};
use embedded_storage::nor_flash::NorFlash;
use weights::Uploading;

/// The hardware that an image drives; a configuration of anything else is refused.
#[derive(Debug)]
pub struct SupportedHardware {
    /// Inertial sensors.
    pub imus: &'static [ImuPart],
    /// Fibre-optic gyros.
    pub fogs: &'static [FogPart],
    /// Bit rates of the bus.
    pub bits_per_second: &'static [u32],
}

/// The state that the board keeps beside the pipeline.
///
/// Owns the flash: records in `R`, weight slots in `W`, `None` where nothing can be stored.
pub struct Device<R: NorFlash, W> {
    store: Option<Store<R>>,
    slots: Option<W>,
    drives: &'static SupportedHardware,
    identity: Identity,
    flash: FlashState,
    writable: bool,
    /// Something that is stored is not used.
    refused: bool,
    configuration: Configuration,
    configuration_origin: Origin,
    wheels: WheelSettings,
    wheels_origin: Origin,
    calibration: Calibration,
    calibration_origin: Origin,
    calibrator: Option<Calibrator>,
    calibration_state: State,
    accepted: Accepted,
    troubles: Troubles,
    weights: WeightSource,
    weights_crc: Option<u32>,
    refused_slots: [Option<SlotError>; 2],
    uploading: Option<Uploading>,
    standstill: StandstillGate,
    sensor: Option<SensorFault>,
    status: Status,
    faults: Faults,
    tick: u32,
    log: EventLog,
    deframer: Deframer,
    service_errors: u32,
    restart: bool,
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Begins with built-in values, before [`Device::begin`]. It is a constant, so that it can be made in its
    /// place.
    #[must_use]
    pub const fn new(drives: &'static SupportedHardware) -> Self {
        Self {
            store: None,
            slots: None,
            drives,
            identity: Identity::UNKNOWN,
            flash: FlashState::Absent,
            writable: false,
            refused: false,
            configuration: Configuration::DEFAULT,
            configuration_origin: Origin::BuiltIn,
            wheels: WheelSettings::TOYOTA,
            wheels_origin: Origin::BuiltIn,
            calibration: Calibration::NONE,
            calibration_origin: Origin::BuiltIn,
            calibrator: None,
            calibration_state: State::Idle,
            accepted: Accepted::NONE,
            troubles: Troubles::NONE,
            weights: WeightSource::None,
            weights_crc: None,
            refused_slots: [None; 2],
            uploading: None,
            standstill: StandstillGate::new(),
            sensor: None,
            status: Status::Init,
            faults: Faults::NONE,
            tick: 0,
            log: EventLog::new(),
            deframer: Deframer::new(),
            service_errors: 0,
            restart: false,
        }
    }

    /// Returns the configuration that the image runs with.
    #[must_use]
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// Returns the wheel frames that the image receives.
    #[must_use]
    pub fn wheels(&self) -> &WheelSettings {
        &self.wheels
    }

    /// Returns the calibration.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Returns whether a restart was requested; the answer should go out first.
    #[must_use]
    pub fn restart_wanted(&self) -> bool {
        self.restart
    }

    /// Notes how setting the sensor up went; the same result again is not noted again.
    pub fn sensor(&mut self, result: Result<(), SensorFault>) {
        let fault = result.err();
        if fault.is_none() || fault != self.sensor {
            self.note(EventKind::Sensor(fault));
        }
        self.sensor = fault;
    }

    /// Takes every sample of the sensor (`None` while it is silent), with the status and faults of what was made of it
    /// and what the wheels show.
    pub fn observe(
        &mut self,
        sample: Option<&ImuSample>,
        tick: u32,
        (status, faults): (Status, Faults),
        wheels: Standstill,
    ) {
        self.tick = tick;
        self.faults = faults;
        self.standstill.observe(sample, wheels, &self.configuration.static_init);
        if status != self.status {
            self.status = status;
            self.note(EventKind::Status(status));
        }
        let (Some(calibrator), Some(sample)) = (self.calibrator.as_mut(), sample) else { return };
        let task = calibrator.task();
        if let Some(result) = calibrator.add(sample, &self.configuration.mounting, &mut self.calibration) {
            self.calibrator = None;
            self.calibration_state = match result {
                Ok(()) => State::Found(task),
                Err(fault) => State::Failed(task, fault),
            };
            self.note(EventKind::Calibrated(result.err()));
        }
    }

    /// Takes a byte of the service line; with the last one of a request returns the answer.
    #[inline(never)]
    pub fn receive(&mut self, byte: u8, counters: &AllCounters) -> Option<Frame> {
        let (number, reply) = match self.deframer.receive(byte)? {
            Ok((number, request)) => (number, self.handle(&request, counters)),
            Err(error) => {
                count(&mut self.service_errors, 1);
                let FrameError::Message { number } = error else { return None };
                (number, Reply::Refused(Refusal::Unknown))
            }
        };
        emit(number, &reply)
    }

    /// Answers a request.
    fn handle(&mut self, request: &Request, counters: &AllCounters) -> Reply {
        if let Some(reply) = self.reply(request, counters) {
            return reply;
        }
        match (self.act(request), self.uploading) {
            (Err(refusal), _) => Reply::Refused(refusal),
            (Ok(()), Some(Uploading { upload, checked })) if request.uploads() => {
                Reply::Weights { slot: upload.slot(), written: upload.written(), checked }
            }
            (Ok(()), _) => Reply::Done,
        }
    }

    /// Answers a question.
    #[inline(never)]
    fn reply(&self, request: &Request, counters: &AllCounters) -> Option<Reply> {
        Some(match request {
            Request::Info => Reply::Info(self.info()),
            Request::GetConfiguration => Reply::Configuration {
                version: Configuration::VERSION,
                origin: self.configuration_origin,
                configuration: self.configuration,
            },
            Request::GetWheels => Reply::Wheels { origin: self.wheels_origin, wheels: self.wheels },
            Request::GetCalibration => Reply::Calibration {
                version: Calibration::VERSION,
                origin: self.calibration_origin,
                state: self.calibration_state,
                calibration: self.calibration.clone(),
            },
            Request::Log { after } => Reply::Log(self.log.page(*after)),
            Request::Counters => {
                let lines = LineCounters { service_errors: self.service_errors, ..counters.lines };
                Reply::Counters(AllCounters { lines, ..*counters })
            }
            _ => return None,
        })
    }

    /// Executes a request.
    #[inline(never)]
    pub(crate) fn act(&mut self, request: &Request) -> Result<(), Refusal> {
        if request.interrupts() && !self.may_interrupt() {
            return Err(Refusal::Moving);
        }
        match request {
            Request::SetConfiguration { version, configuration } => {
                self.set_configuration(*version, configuration)
            }
            Request::SetWheels(wheels) => self.set_wheels(wheels),
            Request::Calibrate(what) => self.calibrate(*what),
            Request::WeightsBegin { length } => self.weights_begin(*length),
            Request::WeightsBlock { offset, bytes } => self.weights_block(*offset, bytes),
            Request::WeightsVerify => self.weights_verify(),
            Request::WeightsActivate => self.weights_activate(),
            Request::Restart => {
                self.restart = true;
                Ok(())
            }
            Request::Info
            | Request::GetConfiguration
            | Request::GetWheels
            | Request::GetCalibration
            | Request::Log { .. }
            | Request::Counters => Ok(()),
        }
    }

    /// Returns whether the output may be interrupted: the vehicle is proven to stand. A board without a flash
    /// controller is emulated, and nothing depends on it.
    pub(crate) fn may_interrupt(&self) -> bool {
        !self.writable || self.standstill.is_open()
    }

    fn refuse(&mut self, kind: EventKind) {
        self.refused = true;
        self.note(kind);
    }

    fn note(&mut self, kind: EventKind) {
        self.log.record(self.tick, kind);
    }

    pub(crate) fn info(&self) -> Info {
        Info {
            protocol: PROTOCOL,
            identity: self.identity,
            record_versions: [Configuration::VERSION, Calibration::VERSION],
            flash: self.flash,
            writable: self.writable,
            configuration: self.configuration_origin,
            calibration: self.calibration_origin,
            weights: self.weights,
            weights_crc: self.weights_crc,
            sensor: self.sensor,
            refused_slots: self.refused_slots,
            status: self.status,
        }
    }

    /// Returns what the memory of troubles is updated from.
    pub(crate) fn conditions(&self) -> Conditions {
        Conditions {
            status: self.status,
            faults: self.faults,
            no_weights: self.weights == WeightSource::None,
            sensor_refused: self.sensor.is_some(),
            clock_fault: self.identity.clock_fault.is_some(),
            tick: self.tick,
            can_fault: self.identity.can_fault.is_some(),
            crashed: self.identity.crash.is_some(),
        }
    }

    /// Returns how a calibration goes.
    pub(crate) fn calibration_state(&self) -> State {
        self.calibration_state
    }

    fn calibrate(&mut self, what: Calibrate) -> Result<(), Refusal> {
        match what {
            Calibrate::Start(task) => self.start_calibration(task),
            Calibrate::Cancel => {
                self.calibrator = None;
                self.calibration_state = State::Idle;
            }
            Calibrate::Store => {
                if !matches!(self.calibration_state, State::Found(_)) {
                    return Err(Refusal::NothingFound);
                }
                self.store_calibration()?;
                self.calibration_state = State::Idle;
            }
            Calibrate::SetUnit(unit) => self.set_unit(unit)?,
        }
        Ok(())
    }

    #[inline(never)]
    fn start_calibration(&mut self, task: Task) {
        self.calibrator = Some(Calibrator::new(task, self.configuration.static_init));
        self.calibration_state = State::Running(task);
    }
}
