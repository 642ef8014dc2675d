//! These types are the requests that change the board, and what it reports.

use super::calibrate::Task;
use super::event::{CanFault, ClockFault, Crash, ResetCause, SensorFault};
use crate::can::wheel::WheelSettings;
use crate::fog::FogCounters;
use crate::health::{Counters, InputCounters, MonitorCounters, Status};
use crate::store::slots::{SlotError, WeightSource};
use crate::store::{Configuration, StoreError, UnitMap};
use serde::{Deserialize, Serialize};

/// The version of what is encoded as these types; it is raised when one changes.
pub const PROTOCOL: u8 = 13;
/// Most bytes of a block of weights.
pub const BLOCK: usize = 256;

/// The requests that change something.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "no heap to put the large ones on; one exists at a time")]
pub enum Request<'a> {
    /// A new configuration.
    SetConfiguration {
        /// The version of its layout.
        version: u8,
        /// Whole.
        configuration: &'a Configuration,
    },
    /// Other wheel frames.
    SetWheels(WheelSettings),
    /// Something to do about the calibration.
    Calibrate(Calibrate),
    /// A weight file will come.
    WeightsBegin {
        /// Of this network.
        network: Network,
        /// Its length, bytes.
        length: u32,
    },
    /// A part of it.
    WeightsBlock {
        /// Its place in the file.
        offset: u32,
        /// A whole number of words.
        bytes: &'a [u8],
    },
    /// The file is complete.
    WeightsVerify,
    /// Use it.
    WeightsActivate,
    /// Reset, which is up to the caller.
    Restart,
}

impl Request<'_> {
    /// Returns whether the request interrupts the output, because it writes the flash or restarts the board.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        match self {
            Self::SetConfiguration { .. }
            | Self::SetWheels(_)
            | Self::Calibrate(Calibrate::Store | Calibrate::Forget | Calibrate::SetUnit(_))
            | Self::WeightsBegin { .. }
            | Self::WeightsBlock { .. }
            | Self::WeightsActivate
            | Self::Restart => true,
            Self::Calibrate(Calibrate::Start(_) | Calibrate::Cancel) | Self::WeightsVerify => false,
        }
    }
}

/// The networks that have weight files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Network {
    /// GyroNet.
    GyroNet,
    /// FoGNet.
    FogNet,
}

/// The action on the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Calibrate {
    /// Begin.
    Start(Task),
    /// Stop without a result.
    Cancel,
    /// Keep over the next start what was found.
    Store,
    /// Forget what the board has learnt about its sensor.
    Forget,
    /// Store the map of this unit's gyro, or none; it holds from the next start on.
    SetUnit(Option<UnitMap>),
}

/// The reason why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// Another layout of the configuration.
    #[error("configuration layout {found}, the board has {expected}")]
    Version {
        /// The version in the request.
        found: u8,
        /// The version of this firmware.
        expected: u8,
    },
    /// The store refuses, or a value of the configuration is out of its range.
    #[error(transparent)]
    Store(StoreError),
    /// The weight slots refuse.
    #[error(transparent)]
    Slot(SlotError),
    /// There is no result that could be stored.
    #[error("no calibration has been found that could be stored")]
    NothingFound,
    /// The map of the gyro was found with other weights than the board runs.
    #[error("found with the weights {found:08x}, the board runs {runs:08x}")]
    OtherWeights {
        /// The checksum of those.
        found: u32,
        /// The checksum of the board's.
        runs: u32,
    },
    /// A key is needed, and this session has not proven to have it.
    #[error("the board has a key, and this session has no access: give its private part with --key")]
    Locked,
    /// The data have no signature, and the board has a key.
    #[error("the board has a key, and what is written is not signed: give --key or --signature")]
    Unsigned,
    /// The answer to a challenge is none of the board's key.
    #[error("the answer to the board's challenge is not one of its key: this is the key of another board")]
    Answer,
    /// The signature is none of the board's key, or is for another identifier, content or board.
    #[error("the signature is not one of the board's key for this content, identifier and board")]
    Signature,
    /// The signature has been used, or a newer one has.
    #[error("the signature's counter is {found}, and one of {newest} was accepted: sign with a greater one")]
    Counter {
        /// The counter of the signature.
        found: u32,
        /// The newest one.
        newest: u32,
    },
    /// The vehicle is not proven to stand: writing the flash would interrupt the output.
    #[error("the vehicle is not proven to stand still")]
    Moving,
}

impl Refusal {
    /// Returns whether the request was refused because nobody has proven that it is the owner's.
    #[must_use]
    pub const fn is_for_want_of_access(&self) -> bool {
        matches!(self, Self::Locked | Self::Unsigned | Self::Answer | Self::Signature | Self::Counter { .. })
    }
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<SlotError> for Refusal {
    fn from(error: SlotError) -> Self {
        Self::Slot(error)
    }
}

/// The origin of a record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Origin {
    /// Built in: nothing is stored.
    BuiltIn,
    /// The record was read from flash.
    Stored,
    /// Built in: what is stored is refused.
    Refused(StoreError),
}

/// The board's identity when it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The version of the firmware.
    pub firmware: [u8; 3],
    /// DBGMCU_IDCODE; `None` where it reads as zero, as in the emulator.
    pub device_id: Option<u32>,
    /// The frequency of the processor, Hz.
    pub clock_hz: u32,
    /// The unique number of the chip; zeros in the emulator.
    pub serial: [u8; 12],
    /// The reason why the clock is not the crystal's; `None` where it is.
    pub clock_fault: Option<ClockFault>,
    /// The reason why frames go out as SLCAN alone; `None` where they go out on CAN too.
    pub can_fault: Option<CanFault>,
    /// The cause of its start.
    pub reset: ResetCause,
    /// Its last crash since power came on.
    pub crash: Option<Crash>,
}

impl Identity {
    /// The state before anything is known.
    pub const UNKNOWN: Self = Self {
        firmware: [0; 3],
        device_id: None,
        serial: [0; 12],
        clock_hz: 0,
        clock_fault: None,
        can_fault: None,
        reset: ResetCause::Unknown,
        crash: None,
    };
}

/// State of the flash.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FlashState {
    /// There is none that this image can read.
    Absent,
    /// All records are whole.
    Ready,
    /// A record is not whole; the one before it is used.
    Damaged,
    /// It cannot be read.
    Failed(StoreError),
}

/// The board's identity and state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`PROTOCOL`].
    pub protocol: u8,
    /// Known since the start.
    pub identity: Identity,
    /// Layout of the configuration and of the calibration.
    pub record_versions: [u8; 2],
    /// The state of the store.
    pub flash: FlashState,
    /// A controller answers, so that something can be stored; the emulator has none.
    pub writable: bool,
    /// The origin of the configuration.
    pub configuration: Origin,
    /// The origin of the wheel settings.
    pub wheels: Origin,
    /// The origin of the calibration.
    pub calibration: Origin,
    /// The weights that the network runs on.
    pub weights: WeightSource,
    /// Their checksum.
    pub weights_crc: Option<u32>,
    /// The reason why the sensor could not be set up, where the board does so.
    pub sensor: Option<SensorFault>,
    /// The reason why each slot that should be used is not.
    pub refused_slots: [Option<SlotError>; 2],
    /// The checksum of FoGNet's weights, or why they are not used; `None` where FoGNet is off.
    pub fognet: Option<Result<u32, SlotError>>,
    /// The status of the corrected yaw rate.
    pub status: Status,
}

/// Everything that is counted since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct AllCounters {
    /// The counters of the pipeline.
    pub pipeline: Counters,
    /// The counters of the sensor monitor.
    pub watch: MonitorCounters,
    /// The counters of the lines.
    pub lines: LineCounters,
    /// The counters of the fibre-optic gyro.
    pub fog: FogCounters,
    /// The counters of the coprocessor's inputs.
    pub inputs: InputCounters,
}

/// The numbers of requests that were refused for want of access since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct AccessCounters {
    /// Requests in a session without access.
    pub locked: u32,
    /// Contents without a signature.
    pub unsigned: u32,
    /// Wrong answers to a challenge.
    pub answers: u32,
    /// Wrong signatures.
    pub signatures: u32,
    /// Signatures that had been used, or were older than one that had.
    pub replayed: u32,
}

impl AccessCounters {
    /// The counters before the first refusal.
    pub const NONE: Self = Self { locked: 0, unsigned: 0, answers: 0, signatures: 0, replayed: 0 };

    /// Counts a refusal, where it was for want of access.
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

/// The numbers of errors on the lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LineCounters {
    /// Frames that the SLCAN line did not take.
    pub unsent: u32,
    /// Bytes of the sensor and SLCAN lines that came damaged, or too fast.
    pub line_errors: u32,
    /// Bytes that had to wait because a line's queue was full: what comes meanwhile is lost, where
    /// the line cannot be made to wait.
    pub held: u32,
    /// Observations for which a task of lower priority had no time.
    pub overruns: u32,
    /// Lines of the service line that were refused.
    pub service_errors: u32,
    /// Frames of the CAN bus that passed the filters and found no room.
    pub frames_lost: u32,
}

impl LineCounters {
    /// The counters before the first event.
    pub const NONE: Self =
        Self { unsent: 0, line_errors: 0, held: 0, overruns: 0, service_errors: 0, frames_lost: 0 };
}
