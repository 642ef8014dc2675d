//! Refusals of requests, and reports of the board's state.

use super::event::{CanFault, ClockFault, Crash, ResetCause, SensorFault};
use crate::coprocessor::{Contradiction, Coprocessor};
use crate::fog::FogCounters;
use crate::health::{Counters, InputCounters, MonitorCounters, Status, counters};
use crate::store::firmware::FirmwareError;
use crate::store::slots::{SlotError, WeightSource};
use crate::store::{Calibration, Configuration, Record, Slot, StoreError};
use serde::{Deserialize, Serialize};

/// Version of the encoding of these types; every change of a type increments it.
pub const PROTOCOL: u8 = 23;
/// Size of a full block of a download, bytes.
pub const BLOCK: usize = 256;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[allow(missing_docs, reason = "its messages say it")]
pub enum Refusal {
    #[error("configuration layout {found}, but the board has {expected}")]
    Version { found: u8, expected: u8 },
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Slot(#[from] SlotError),
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    #[error("calibrated with weights {found:08x}, but the board runs {runs:08x}")]
    OtherWeights { found: u32, runs: u32 },
    #[error("the board has a key, and this session has no access: give its private part with --key")]
    Locked,
    #[error("the board has a key, and the data are not signed: give --key or --signature")]
    Unsigned,
    #[error("the answer to the challenge does not match the board's key: this is the key of another board")]
    Answer,
    #[error("the signature does not match the board's key, or this content, identifier and board")]
    Signature,
    #[error("the signature's counter is {found}, but {newest} was already accepted: sign with a greater one")]
    Counter { found: u32, newest: u32 },
    /// A single setting was written; only the whole configuration can be.
    #[error(
        "single settings (data 0201 to 021E) were retired: write the configuration, data 0100, as `gyronet device set` does"
    )]
    SingleSetting,
    #[error("FoGNet no longer runs on this board: address 0 takes GyroNet's weights")]
    FogNet,
    /// The vehicle is not proven to stand: writing the flash would interrupt the output.
    #[error("the vehicle is not proven to stand still")]
    Moving,
    #[error("a tester on another line has a session, which ends 5 s after its last request")]
    OtherTester,
}

impl Refusal {
    /// Returns whether the request was refused for lack of access: no valid proof or signature.
    pub const fn is_access_denied(&self) -> bool {
        matches!(self, Self::Locked | Self::Unsigned | Self::Answer | Self::Signature | Self::Counter { .. })
    }
}

/// The origin of the settings in use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Origin {
    /// Built in, because nothing is stored.
    BuiltIn,
    /// Read from flash.
    Stored,
    /// Built in, because the stored record was refused.
    Refused(StoreError),
}

/// Failed starts after which the built-in configuration and weights are used.
pub const FAILED_STARTS: u8 = 3;

/// The board's identity, and what is known about its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the firmware.
    pub firmware: [u8; 3],
    /// DBGMCU_IDCODE; `None` where the board cannot tell.
    pub device_id: Option<u32>,
    /// Clock frequency of the processor, Hz.
    pub clock_hz: u32,
    /// Unique number of the chip.
    pub serial: [u8; 12],
    /// Reason why the processor does not run on the crystal; `None` if it does.
    pub clock_fault: Option<ClockFault>,
    /// Reason why frames are sent only as SLCAN; `None` if they are also sent on CAN.
    pub can_fault: Option<CanFault>,
    /// Cause of the last reset.
    pub reset: ResetCause,
    /// Last crash since power-on.
    pub crash: Option<Crash>,
    /// Starts in a row that have ended in a crash or a reset by the watchdog within a minute.
    pub failed_starts: u8,
}

impl Identity {
    /// Identity before the start.
    pub const UNKNOWN: Self = Self {
        firmware: [0; 3],
        device_id: None,
        serial: [0; 12],
        clock_hz: 0,
        clock_fault: None,
        can_fault: None,
        reset: ResetCause::Unknown,
        crash: None,
        failed_starts: 0,
    };
}

/// The state of the record store.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FlashState {
    /// There is no flash that this image can read.
    Absent,
    /// All records are intact.
    Ready,
    /// A record is damaged; the previous one is used.
    Damaged,
    /// The flash cannot be read.
    Failed(StoreError),
}

/// How the running firmware stands to its last update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum FirmwareState {
    /// It was not started by the boot loader, and cannot be updated over diagnosis.
    Alone = 0,
    /// It is confirmed.
    Confirmed = 1,
    /// It is on trial.
    OnTrial = 2,
    /// The update after it did not reach on trial what this one had, and was rolled back.
    RolledBack = 3,
    /// The newer image is damaged, so this one runs.
    NewerDamaged = 4,
}

/// The running firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Firmware {
    /// Slot of the image that runs.
    pub slot: Option<Slot>,
    /// CRC-32 of that image, which tells builds of one version apart.
    pub crc: Option<u32>,
    /// How it stands to its last update.
    pub state: FirmwareState,
}

impl Firmware {
    pub(super) const ALONE: Self = Self { slot: None, crc: None, state: FirmwareState::Alone };

    /// Returns whether the newest update does not run.
    pub const fn is_refused(&self) -> bool {
        matches!(self.state, FirmwareState::RolledBack | FirmwareState::NewerDamaged)
    }
}

/// The board's identity and state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`PROTOCOL`].
    pub protocol: u8,
    /// Identity of the board.
    pub identity: Identity,
    /// Layout versions of configuration and calibration.
    pub record_versions: [u8; 2],
    /// State of the record store.
    pub flash: FlashState,
    /// True if data can be stored: the board has a flash, and its controller is in order.
    pub writable: bool,
    /// Origin of the configuration.
    pub configuration: Origin,
    /// Origin of the wheel settings.
    pub wheels: Origin,
    /// Origin of the calibration.
    pub calibration: Origin,
    /// Origin of the weights that GyroNet runs on.
    pub weights: WeightSource,
    /// Checksum of these weights.
    pub weights_crc: Option<u32>,
    /// Reason why the sensor could not be set up, if the board does so.
    pub sensor: Option<SensorFault>,
    /// Reasons why slots A and B were refused, if they were tried.
    pub refused_slots: [Option<SlotError>; 2],
    /// The firmware that runs, and what became of its update.
    pub firmware: Firmware,
    /// The newest reason why stored data were refused, or could not be stored by the board itself.
    pub stored_fault: Option<StoreError>,
    /// Status of the corrected yaw rate.
    pub status: Status,
}

impl Info {
    /// Identity and state before the start.
    pub const UNKNOWN: Self = Self {
        protocol: PROTOCOL,
        identity: Identity::UNKNOWN,
        record_versions: [Configuration::VERSION, Calibration::VERSION],
        flash: FlashState::Absent,
        writable: false,
        configuration: Origin::BuiltIn,
        wheels: Origin::BuiltIn,
        calibration: Origin::BuiltIn,
        weights: WeightSource::None,
        weights_crc: None,
        sensor: None,
        refused_slots: [None; 2],
        firmware: Firmware::ALONE,
        stored_fault: None,
        status: Status::Init,
    };
}

/// All event counters since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct AllCounters {
    /// Counters of the pipeline.
    pub pipeline: Counters,
    /// Counters of the sensor monitor.
    pub watch: MonitorCounters,
    /// Counters of the serial lines and the CAN bus.
    pub lines: LineCounters,
    /// Counters of the fibre-optic gyro.
    pub fog: FogCounters,
    /// Counters of the coprocessor's inputs.
    pub inputs: InputCounters,
    /// Seconds in which the sources of the yaw rate contradicted each other, and the newest one's numbers.
    pub contradiction: Contradiction,
}

impl AllCounters {
    /// Returns a board's counters.
    #[inline]
    pub fn of(coprocessor: &Coprocessor, lines: &LineCounters) -> Self {
        Self {
            pipeline: *coprocessor.pipeline().counters(),
            watch: *coprocessor.monitor_counters(),
            lines: *lines,
            fog: *coprocessor.fog_counters(),
            inputs: *coprocessor.input_counters(),
            contradiction: *coprocessor.contradiction(),
        }
    }
}

counters! {
    /// The counters of requests that were refused for lack of access since the start.
    pub struct AccessCounters {
        /// Requests in a session without access.
        pub locked: u32,
        /// Written data without a signature.
        pub unsigned: u32,
        /// Wrong answers to a challenge.
        pub answers: u32,
        /// Wrong signatures.
        pub signatures: u32,
        /// Signatures that had already been used, or were older than the newest one used.
        pub replayed: u32,
    }
}

impl AccessCounters {
    pub(crate) fn count(&mut self, refusal: &Refusal) {
        let counter = match refusal {
            Refusal::Locked => &mut self.locked,
            Refusal::Unsigned => &mut self.unsigned,
            Refusal::Answer => &mut self.answers,
            Refusal::Signature => &mut self.signatures,
            Refusal::Counter { .. } => &mut self.replayed,
            _ => return,
        };
        *counter = counter.saturating_add(1);
    }
}

counters! {
    /// The error counters of the serial lines and the CAN bus.
    pub struct LineCounters {
        /// Frames that were dropped on the SLCAN line.
        pub unsent: u32,
        /// Receive errors of the sensor and SLCAN lines: corrupt bytes and overruns.
        pub line_errors: u32,
        /// Observations that a task of lower priority missed for lack of time.
        pub overruns: u32,
        /// Text lines of hosts, on SLCAN and on the service line, that were refused.
        pub service_errors: u32,
        /// CAN frames that passed the filters but were lost because the queue was full.
        pub frames_lost: u32,
    }
}
