//! The board's side of the service line: what it keeps, and what it answers.
//!
//! Some functions are kept out of their callers: what they have on the stack, requests, replies and
//! records, is then there only while they run.

use super::calibrate::{Calibrator, State, Task};
use super::event::{EventKind, EventLog, SensorFault};
use super::frame::{Deframer, Frame, FrameError, emit};
use super::message::{
    AllCounters, BLOCK, Calibrate, FlashState, Identity, Info, LineCounters, Origin, PROTOCOL, Refusal,
    Reply, Request,
};
use crate::health::{Status, count};
use crate::model::Blob;
use crate::sample::ImuSample;
use crate::store::slots::{Selection, SlotError, Upload, WeightSource, select};
use crate::store::{
    Accepted, Calibration, Configuration, FieldError, FogPart, ImuPart, Record, Slot, Store, StoreError,
};
use embedded_storage::nor_flash::NorFlash;

/// The flash of the weight slots, which the processor can also read in place.
pub trait MappedSlots: NorFlash {
    /// Both slots, each on a word boundary.
    fn slots(&self) -> [&[u8]; 2];
}

/// An upload, and its file's checksum once checked.
#[derive(Debug, Clone, Copy)]
struct Uploading {
    upload: Upload,
    checked: Option<u32>,
}

/// What an image drives; a configuration of anything else is refused.
#[derive(Debug)]
pub struct Drives {
    /// Inertial sensors.
    pub imus: &'static [ImuPart],
    /// Fibre-optic gyros.
    pub fogs: &'static [FogPart],
    /// Bit rates of the bus.
    pub bits_per_second: &'static [u32],
}

/// What the board keeps beside the pipeline.
///
/// Owns the flash: records in `R`, weight slots in `W`, `None` where nothing can be stored.
pub struct Device<R: NorFlash, W> {
    store: Option<Store<R>>,
    slots: Option<W>,
    drives: &'static Drives,
    identity: Identity,
    flash: FlashState,
    writable: bool,
    /// Something that is stored is not used.
    refused: bool,
    configuration: Configuration,
    configuration_origin: Origin,
    calibration: Calibration,
    calibration_origin: Origin,
    calibrator: Option<Calibrator>,
    calibration_state: State,
    accepted: Accepted,
    weights: WeightSource,
    weights_crc: Option<u32>,
    refused_slots: [Option<SlotError>; 2],
    uploading: Option<Uploading>,
    sensor: Option<SensorFault>,
    status: Status,
    tick: u32,
    log: EventLog,
    deframer: Deframer,
    service_errors: u32,
    restart: bool,
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// With built-in values, before [`Device::begin`]. A constant: it can be made where it stays.
    #[must_use]
    pub const fn new(drives: &'static Drives) -> Self {
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
            calibration: Calibration::NONE,
            calibration_origin: Origin::BuiltIn,
            calibrator: None,
            calibration_state: State::Idle,
            accepted: Accepted::NONE,
            weights: WeightSource::None,
            weights_crc: None,
            refused_slots: [None; 2],
            uploading: None,
            sensor: None,
            status: Status::Init,
            tick: 0,
            log: EventLog::new(),
            deframer: Deframer::new(),
            service_errors: 0,
            restart: false,
        }
    }

    /// Reads what is stored; what is not whole or not in its range is not used and noted.
    /// `writable`: a controller answers; without one what is stored can be read all the same.
    pub fn begin(&mut self, records: Option<R>, slots: Option<W>, writable: bool, identity: Identity) {
        self.identity = identity;
        self.writable = writable;
        // What can only be read is read here; later neither is there to be changed.
        self.slots = slots.filter(|_| writable);
        self.note(EventKind::Started(identity.reset));
        if let Some(crash) = identity.crash {
            self.note(EventKind::Crashed(crash));
        }
        if let Some(records) = records {
            match Store::open(records, 0) {
                Ok(store) => self.load(store),
                Err(error) => self.flash = FlashState::Failed(error),
            }
        }
        if self.records_damaged() {
            self.note(EventKind::RecordsDamaged);
        }
    }

    fn records_damaged(&self) -> bool {
        matches!(self.flash, FlashState::Damaged | FlashState::Failed(_))
    }

    /// Whether anything that is stored is damaged or refused: [`crate::health::Faults::STORED`].
    #[must_use]
    pub fn stored_damaged(&self) -> bool {
        self.refused || self.records_damaged()
    }

    /// Whether a configuration was stored and none is used: what the sensor's axes are is not known.
    #[must_use]
    pub fn configuration_lost(&self) -> bool {
        match self.configuration_origin {
            Origin::BuiltIn => self.records_damaged(),
            Origin::Stored => false,
            Origin::Refused(_) => true,
        }
    }

    fn load(&mut self, mut store: Store<R>) {
        let found = store.get::<Configuration>();
        match found.and_then(|found| found.map(|found| self.drivable(&found).map(|()| found)).transpose()) {
            Ok(Some(configuration)) => {
                self.configuration = configuration;
                self.configuration_origin = Origin::Stored;
            }
            Ok(None) => {}
            Err(error) => {
                self.configuration_origin = Origin::Refused(error);
                self.refuse(EventKind::ConfigurationRefused(error));
            }
        }
        match store.get() {
            Ok(Some(calibration)) => {
                self.calibration = calibration;
                self.calibration_origin = Origin::Stored;
            }
            Ok(None) => {}
            Err(error) => {
                self.calibration_origin = Origin::Refused(error);
                self.refuse(EventKind::CalibrationRefused(error));
            }
        }
        match store.get() {
            Ok(accepted) => self.accepted = accepted.unwrap_or(Accepted::NONE),
            Err(error) => self.refuse(EventKind::AcceptedRefused(error)),
        }
        self.flash = if store.damaged() { FlashState::Damaged } else { FlashState::Ready };
        self.store = self.writable.then_some(store);
    }

    fn drivable(&self, configuration: &Configuration) -> Result<(), StoreError> {
        let Drives { imus, fogs, bits_per_second } = self.drives;
        if !imus.contains(&configuration.imu) || configuration.fog.is_some_and(|fog| !fogs.contains(&fog)) {
            return Err(StoreError::Field(FieldError::PartNotInImage));
        }
        let rate = configuration.can.bits_per_second;
        if bits_per_second.contains(&rate) {
            Ok(())
        } else {
            Err(StoreError::Field(FieldError::BitRateNotInImage(rate)))
        }
    }

    /// The weights to run on: `slots` as the processor reads them, the image's own last.
    pub fn weights<'w>(&mut self, slots: Option<[&'w [u8]; 2]>, built_in: &'w [u8]) -> Option<Blob<'w>> {
        let Selection { weights, source, refused } =
            select(&self.accepted, slots.unwrap_or_default(), built_in);
        self.weights = source;
        self.weights_crc = weights.map(|blob| blob.crc);
        self.refused_slots = refused;
        for (slot, error) in Slot::ALL.into_iter().zip(refused) {
            if let Some(error) = error {
                self.refuse(EventKind::SlotRefused(slot, error));
            }
        }
        if source == WeightSource::None {
            self.refuse(EventKind::NoWeights);
        }
        weights
    }

    /// The weights in use no longer fit their checksum; they are used no more until the next
    /// start, which checks all files anew.
    pub fn weights_damaged(&mut self) {
        self.weights = WeightSource::None;
        self.weights_crc = None;
        self.note(EventKind::WeightsDamaged);
    }

    /// What the image is to run with.
    #[must_use]
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// What is known of the sensor.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Whether a restart was asked for; the answer should go out first.
    #[must_use]
    pub fn restart_wanted(&self) -> bool {
        self.restart
    }

    /// How setting the sensor up went; the same again is not noted again.
    pub fn sensor(&mut self, result: Result<(), SensorFault>) {
        let fault = result.err();
        if fault.is_none() || fault != self.sensor {
            self.note(EventKind::Sensor(fault));
        }
        self.sensor = fault;
    }

    /// Takes every sample of the sensor (`None` while it is silent), with the status of what was made of it.
    pub fn observe(&mut self, sample: Option<&ImuSample>, tick: u32, status: Status) {
        self.tick = tick;
        if status != self.status {
            self.status = status;
            self.note(EventKind::Status(status));
        }
        let (Some(calibrator), Some(sample)) = (self.calibrator.as_mut(), sample) else { return };
        let task = calibrator.task();
        if let Some(result) = calibrator.process(sample, &self.configuration.mounting, &mut self.calibration)
        {
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
    pub fn push(&mut self, byte: u8, counters: &AllCounters) -> Option<Frame> {
        let (number, reply) = match self.deframer.push(byte)? {
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
        if let Some(reply) = self.tell(request, counters) {
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
    fn tell(&self, request: &Request, counters: &AllCounters) -> Option<Reply> {
        Some(match request {
            Request::Info => Reply::Info(self.info()),
            Request::GetConfiguration => Reply::Configuration {
                version: Configuration::VERSION,
                origin: self.configuration_origin,
                configuration: self.configuration,
            },
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

    /// Does what is asked.
    #[inline(never)]
    fn act(&mut self, request: &Request) -> Result<(), Refusal> {
        match request {
            Request::SetConfiguration { version, configuration } => {
                self.set_configuration(*version, configuration)
            }
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
            | Request::GetCalibration
            | Request::Log { .. }
            | Request::Counters => Ok(()),
        }
    }

    fn refuse(&mut self, kind: EventKind) {
        self.refused = true;
        self.note(kind);
    }

    fn note(&mut self, kind: EventKind) {
        self.log.push(self.tick, kind);
    }

    fn info(&self) -> Info {
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

    fn store(&mut self) -> Result<&mut Store<R>, StoreError> {
        self.store.as_mut().ok_or(StoreError::NoFlash)
    }

    fn set_configuration(&mut self, found: u8, configuration: &Configuration) -> Result<(), Refusal> {
        let expected = Configuration::VERSION;
        if found != expected {
            return Err(Refusal::Version { found, expected });
        }
        // Where nothing can be stored, a bad value is named all the same.
        configuration.check().map_err(StoreError::from)?;
        self.drivable(configuration)?;
        self.store()?.set(configuration)?;
        self.note(EventKind::ConfigurationStored);
        Ok(())
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
                let store = self.store.as_mut().ok_or(StoreError::NoFlash)?;
                store.set(&self.calibration)?;
                self.calibration_origin = Origin::Stored;
                self.calibration_state = State::Idle;
                self.note(EventKind::CalibrationStored);
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn start_calibration(&mut self, task: Task) {
        self.calibrator = Some(Calibrator::new(task, self.configuration.static_init));
        self.calibration_state = State::Running(task);
    }

    /// The slot that the network does not run on.
    fn unused_slot(&self) -> Slot {
        match self.weights {
            WeightSource::Slot(slot) => slot.other(),
            // The network runs on neither; the file accepted last is spared all the same.
            WeightSource::BuiltIn | WeightSource::None => self.accepted.active.map_or(Slot::A, Slot::other),
        }
    }

    fn weights_begin(&mut self, length: u32) -> Result<(), Refusal> {
        let slot = self.unused_slot();
        self.uploading = None;
        let flash = self.slots.as_mut().ok_or(SlotError::NoFlash)?;
        let upload = Upload::begin(flash, slot, length)?;
        self.uploading = Some(Uploading { upload, checked: None });
        Ok(())
    }

    fn weights_block(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let flash = self.slots.as_mut().ok_or(SlotError::NoFlash)?;
        let uploading = self.uploading.as_mut().ok_or(SlotError::NotBegun)?;
        // Every block but the last one is full, so a block that is there already ends where the
        // next one begins.
        let written = uploading.upload.written();
        let repeated = bytes.len() <= BLOCK && offset.checked_add(bytes.len() as u32) == Some(written);
        if repeated {
            return Ok(());
        }
        uploading.upload.block(flash, offset, bytes).map_err(|error| {
            if let SlotError::Flash(_) = error {
                self.uploading = None;
            }
            error.into()
        })
    }

    #[inline(never)]
    fn weights_verify(&mut self) -> Result<(), Refusal> {
        let flash = self.slots.as_ref().ok_or(SlotError::NoFlash)?;
        let uploading = self.uploading.as_mut().ok_or(SlotError::NotBegun)?;
        uploading.checked = Some(uploading.upload.verify(flash.slots())?);
        Ok(())
    }

    fn weights_activate(&mut self) -> Result<(), Refusal> {
        let Uploading { upload, checked } = self.uploading.ok_or(SlotError::NotBegun)?;
        let file = checked.ok_or(SlotError::Incomplete { written: upload.written() })?;
        let accepted = self.accepted.with(upload.slot(), file);
        self.store()?.set(&accepted)?;
        self.accepted = accepted;
        self.uploading = None;
        self.note(EventKind::WeightsAccepted(upload.slot()));
        Ok(())
    }
}
