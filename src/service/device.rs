//! The device holds the stored data, and changes them on request.
//!
//! Functions with large frames are `inline(never)`, so that these exist only while they run.

mod firmware;
mod start;
mod stored;
mod weights;

pub use super::message::{Firmware, FirmwareState};
pub use weights::MappedSlots;

use super::conditions::Conditions;
use super::event::{CanFault, SensorFault};
use super::learner::Learner;
use super::message::{AccessCounters, FAILED_STARTS, Info, Refusal};
use super::not_good::NotGood;
use crate::can::wheel::WheelSettings;
use crate::heading::{CourseState, gain_knowledge};
use crate::health::slow::Knowledge;
use crate::health::{Faults, Quality, Status};
use crate::mounting::{Rotation, Vertical};
use crate::sample::{ImuSample, Standstill, WheelSample};
use crate::standstill::Standing;
use crate::store::slots::WeightSource;
use crate::store::{
    Accepted, Access, Calibration, Configuration, FogPart, ImuPart, Learned, Slot, Store, StoreError,
    Troubles,
};
use embedded_storage::nor_flash::NorFlash;
use weights::Uploading;

/// A request that writes the flash or restarts the board, and so interrupts the output.
const INTERRUPTS: bool = true;

/// The hardware that an image supports; a configuration with other hardware is refused.
#[derive(Debug)]
pub struct SupportedHardware {
    /// Supported inertial sensors.
    pub imus: &'static [ImuPart],
    /// Supported fibre-optic gyros.
    pub fogs: &'static [FogPart],
    /// True if there is a line for a GNSS receiver.
    pub gnss: bool,
    /// True if the CAN controller has CAN FD.
    pub fd: bool,
    /// Clock frequency of the processor on its crystal, Hz.
    pub clock_hz: u32,
}

/// The board's state apart from the pipeline. It owns the flash of records, `R`, and of weights, `W`; both are `None`
/// where nothing can be stored.
pub struct Device<R: NorFlash, W> {
    store: Option<Store<R>>,
    slots: Option<W>,
    supported: &'static SupportedHardware,
    info: Info,
    refused: bool,
    configuration: Configuration,
    next_configuration: Configuration,
    wheels: WheelSettings,
    next_wheels: WheelSettings,
    wheels_seen: WheelSample,
    calibration: Calibration,
    learned: Learned,
    learner: Learner,
    course: CourseState,
    /// True if the sensor was found to have moved; cleared by [`Self::take_mount_moved`].
    mount_moved: bool,
    accepted: Accepted,
    troubles: Troubles,
    /// `None` if the record could not be read; nobody may write then.
    access: Option<Access>,
    access_counters: AccessCounters,
    /// Cost of a window of the weights that a start on the crystal will use, cycles.
    next_window: u32,
    uploading: Option<Uploading>,
    reached: u32,
    has_sample: bool,
    /// The output may be interrupted: no rate is valid, or the vehicle stands.
    may_interrupt: bool,
    /// True from a wheel that turns until the wheels stand, also while they are silent.
    has_turned: bool,
    faults: Faults,
    not_good: NotGood,
    tick: u32,
    refusal: Option<Refusal>,
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Creates a device with built-in values, for use before [`Device::begin`], as a `static` if wanted.
    pub const fn new(supported: &'static SupportedHardware) -> Self {
        Self {
            store: None,
            slots: None,
            supported,
            info: Info::UNKNOWN,
            refused: false,
            configuration: Configuration::DEFAULT,
            next_configuration: Configuration::DEFAULT,
            wheels: WheelSettings::TOYOTA,
            next_wheels: WheelSettings::TOYOTA,
            wheels_seen: WheelSample::without_speeds(Standstill::Unknown),
            calibration: Calibration::NONE,
            learned: Learned::NOTHING,
            learner: Learner::START,
            course: CourseState::START,
            mount_moved: false,
            accepted: Accepted::NONE,
            troubles: Troubles::NONE,
            access: Some(Access::OPEN),
            access_counters: AccessCounters::NONE,
            next_window: 0,
            uploading: None,
            reached: 0,
            has_sample: false,
            may_interrupt: true,
            has_turned: false,
            faults: Faults::NONE,
            not_good: NotGood::START,
            tick: 0,
            refusal: None,
        }
    }

    /// Returns the configuration in use.
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// Returns the configuration that the next start will use.
    pub fn next_configuration(&self) -> &Configuration {
        &self.next_configuration
    }

    /// Returns the settings of the wheel frames in use.
    pub fn wheels(&self) -> &WheelSettings {
        &self.wheels
    }

    /// Returns the calibration.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Returns what the board has learnt about its sensor.
    pub fn learned(&self) -> &Learned {
        &self.learned
    }

    /// Returns `true` once after the sensor was found to have moved: [`crate::Coprocessor::mount_moved`].
    pub fn take_mount_moved(&mut self) -> bool {
        core::mem::take(&mut self.mount_moved)
    }

    /// Returns the forward direction, left of the configured x (0 if that is correct), and its sigma, deg.
    pub fn forward_deg(&self) -> Option<[f32; 2]> {
        self.learned.yaw_deg(&self.configuration.mounting.rotation()?)
    }

    /// How well drives have shown the forward direction.
    pub fn forward_knowledge(&self) -> Knowledge {
        let mounting = self.configuration.mounting.rotation();
        mounting.map_or(Knowledge::Unknown, |mounting| self.learned.forward_knowledge(&mounting))
    }

    /// Records the result of setting up the sensor.
    pub fn sensor(&mut self, result: Result<(), SensorFault>) {
        self.info.sensor = result.err();
    }

    /// Records a fault of the CAN controller that was found after the start.
    pub fn can_fault(&mut self, fault: CanFault) {
        self.info.identity.can_fault = Some(fault);
    }

    /// Processes each sample (`None`: silence), the rate's state, the wheels and the standstill. An erase stalls the
    /// processor for up to 2 s: only at standstill, or in silence if no wheel has turned since the vehicle stood.
    pub fn observe(
        &mut self,
        sample: Option<&ImuSample>,
        tick: u32,
        (status, faults): (Status, Faults),
        wheels: &WheelSample,
        standing: &Standing,
    ) {
        self.tick = tick;
        self.faults = faults;
        let limits = &self.configuration.static_init;
        self.wheels_seen = *wheels;
        self.has_sample |= sample.is_some();
        self.has_turned = match wheels.standstill {
            Standstill::Unknown => self.has_turned,
            known => known == Standstill::Moving,
        };
        self.may_interrupt = standing.is_lasting() || sample.is_none() && !self.has_turned;
        if self.configuration.learn
            && self.learner.observe(sample, wheels, standing, limits, &mut self.learned)
        {
            self.mount_moved = true;
        }
        self.info.status = status;
    }

    /// Takes the quality of each rate, after [`Device::observe`].
    pub fn rated(&mut self, quality: Quality, standing: &Standing) {
        self.not_good.observe(quality, self.faults, standing);
    }

    /// Learns what standstills and turns have shown of the vertical.
    pub fn learn_vertical(&mut self, vertical: Vertical) {
        if self.configuration.learn {
            self.learner.learn_vertical(vertical, &mut self.learned);
        }
    }

    /// Takes what courses have shown since the start.
    pub fn learn_course(&mut self, course: &CourseState) {
        self.course = *course;
        if self.configuration.learn
            && let Some(gain) = &course.gain
        {
            self.learner.learn_gain(gain, &mut self.learned);
        }
    }

    /// Returns what courses have shown since the start, and how well the gain is known.
    pub fn course(&self) -> (&CourseState, Knowledge) {
        let gain = self.course.gain.map_or(Knowledge::Unknown, |gain| gain_knowledge(gain.sigma));
        (&self.course, if self.course.is_contradicted { Knowledge::Refused } else { gain })
    }

    /// Returns how well the vertical is known; roll and pitch in the configured axes, and their sigma, deg.
    pub fn level_deg(&self) -> (Knowledge, [f32; 3]) {
        let mounting = self.configuration.mounting.rotation().unwrap_or(Rotation::IDENTITY);
        let vertical = self.learned.vertical.turned(&mounting);
        (vertical.knowledge(), vertical.tilt_deg())
    }

    /// Carries out a request, unless it needs a proven standstill; keeps the reason of a refusal for testers.
    fn request<T>(
        &mut self,
        interrupts: bool,
        work: impl FnOnce(&mut Self) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let result = if interrupts && !self.may_interrupt() { Err(Refusal::Moving) } else { work(self) };
        self.refusal = result.as_ref().err().copied();
        result
    }

    /// Checks that the board may restart; the caller does the reset.
    pub fn restart(&mut self) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |_| Ok(()))
    }

    /// Returns the reason why the last request was refused; `None` if it was executed.
    pub fn refusal(&self) -> Option<Refusal> {
        self.refusal
    }

    pub(crate) fn refuse_request(&mut self, refusal: Refusal) -> Refusal {
        self.access_counters.count(&refusal);
        self.refusal = Some(refusal);
        refusal
    }

    /// Returns the serial number of the board.
    pub fn serial(&self) -> &[u8; 12] {
        &self.info.identity.serial
    }

    /// Returns the access record: the key, and the counters stored with it; `None` if it could not be read.
    pub fn access(&self) -> Option<Access> {
        self.access
    }

    /// Returns the counters of requests that were refused for lack of access.
    pub fn access_counters(&self) -> AccessCounters {
        self.access_counters
    }

    pub(crate) fn forget_refusal(&mut self) {
        self.refusal = None;
    }

    /// Returns the slot and the checksum of the uploaded file, once the file has been checked.
    pub fn uploaded(&self) -> Option<(Slot, u32)> {
        let Uploading { upload, checked } = self.uploading?;
        Some((upload.slot(), checked?.crc))
    }

    /// Returns the newest report of the wheels, and whether the vehicle is proven to stand.
    pub fn standing(&self) -> (&WheelSample, bool) {
        (&self.wheels_seen, self.may_interrupt)
    }

    pub(crate) fn may_interrupt(&self) -> bool {
        self.may_interrupt
    }

    /// Returns whether the starts before this one have failed, so that what is stored is not used.
    fn has_failed(&self) -> bool {
        self.info.identity.failed_starts >= FAILED_STARTS
    }

    /// Runs work that takes long, as [`MappedSlots::check`] does.
    pub(crate) fn long<T>(&self, work: impl FnOnce() -> T) -> T {
        match &self.slots {
            Some(slots) => slots.check(work),
            None => work(),
        }
    }

    fn refuse(&mut self, error: StoreError) {
        self.refused = true;
        self.info.stored_fault = Some(error);
    }

    /// Returns the board's identity and state.
    pub fn info(&self) -> Info {
        self.info
    }

    pub(crate) fn conditions(&self) -> Conditions {
        Conditions {
            status: self.info.status,
            faults: self.faults,
            no_weights: self.info.weights == WeightSource::None,
            sensor_refused: self.info.sensor.is_some(),
            clock_fault: self.info.identity.clock_fault.is_some(),
            tick: self.tick,
            can_fault: self.info.identity.can_fault.is_some(),
            crashed: self.info.identity.crash.is_some() || self.has_failed(),
            course_contradicts: self.course.is_contradicted,
            course_silent: self.course.is_silent,
            not_good_for_long: self.not_good.is_long(),
            firmware_refused: self.info.firmware.is_refused(),
            access_refused: self.refusal.is_some_and(|refusal| refusal.is_access_denied()),
        }
    }

    /// Erases what the board has learnt about its sensor.
    pub fn forget_learned(&mut self) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            device.store_learned(Learned::NOTHING)?;
            device.learner = Learner::START;
            device.learner.keeps_gain = false;
            Ok(())
        })
    }
}
