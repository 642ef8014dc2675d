//! Requests and replies.

use super::calibrate::{State, Task};
use super::event::{CanFault, ClockFault, Crash, LogPage, ResetCause, SensorFault};
use crate::fog::FogCounters;
use crate::health::{Counters, InputCounters, Status, WatchCounters};
use crate::store::slots::{SlotError, WeightSource};
use crate::store::{Calibration, Configuration, Slot, StoreError};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Of the messages; raised when one changes.
pub const PROTOCOL: u8 = 5;
/// Most bytes of a block of weights.
pub const BLOCK: usize = 256;

/// What is asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "no heap to put the large ones on; one exists at a time")]
pub enum Request {
    /// What the board is and how it is.
    Info,
    /// The configuration.
    GetConfiguration,
    /// A new configuration.
    SetConfiguration {
        /// Of its layout.
        version: u8,
        /// Whole.
        configuration: Configuration,
    },
    /// What is known of the sensor.
    GetCalibration,
    /// Something to do about it.
    Calibrate(Calibrate),
    /// Events after a number.
    Log {
        /// 0 for all.
        after: u32,
    },
    /// All counters.
    Counters,
    /// A weight file will come.
    WeightsBegin {
        /// Of the whole file.
        length: u32,
    },
    /// A part of it.
    WeightsBlock {
        /// Its place in the file.
        offset: u32,
        /// A whole number of words.
        bytes: Vec<u8, BLOCK>,
    },
    /// All of it has come.
    WeightsVerify,
    /// Use it.
    WeightsActivate,
    /// Reset.
    Restart,
}

impl Request {
    /// Whether it interrupts the output: it writes the flash, or restarts the board.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        match self {
            Self::SetConfiguration { .. }
            | Self::Calibrate(Calibrate::Store)
            | Self::WeightsBegin { .. }
            | Self::WeightsBlock { .. }
            | Self::WeightsActivate
            | Self::Restart => true,
            Self::Info
            | Self::GetConfiguration
            | Self::GetCalibration
            | Self::Calibrate(Calibrate::Start(_) | Calibrate::Cancel)
            | Self::Log { .. }
            | Self::Counters
            | Self::WeightsVerify => false,
        }
    }

    /// Whether it brings a weight file, and is answered by how much of it is there.
    #[must_use]
    pub const fn uploads(&self) -> bool {
        matches!(self, Self::WeightsBegin { .. } | Self::WeightsBlock { .. } | Self::WeightsVerify)
    }
}

/// What to do about the calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Calibrate {
    /// Begin.
    Start(Task),
    /// Stop without a result.
    Cancel,
    /// Keep over the next start what was found.
    Store,
}

/// What is answered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "no heap to put the large ones on; one exists at a time")]
pub enum Reply {
    /// To `Info`.
    Info(Info),
    /// To `GetConfiguration`.
    Configuration {
        /// Of its layout.
        version: u8,
        /// Where it comes from.
        origin: Origin,
        /// What the board was started with.
        configuration: Configuration,
    },
    /// To `GetCalibration`.
    Calibration {
        /// Of its layout.
        version: u8,
        /// Where it comes from.
        origin: Origin,
        /// How a calibration goes.
        state: State,
        /// What is known.
        calibration: Calibration,
    },
    /// To `Log`.
    Log(LogPage),
    /// To `Counters`.
    Counters(AllCounters),
    /// To the requests for weights.
    Weights {
        /// The slot that takes the file.
        slot: Slot,
        /// Bytes of it that are there; the next block begins here.
        written: u32,
        /// Its checksum, once checked.
        checked: Option<u32>,
    },
    /// It is done.
    Done,
    /// It is not, and nothing has changed.
    Refused(Refusal),
}

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// Not a request of this protocol version.
    #[error("not a request of protocol {PROTOCOL}")]
    Unknown,
    /// Another layout of the configuration.
    #[error("configuration layout {found}, the board has {expected}")]
    Version {
        /// Of the request.
        found: u8,
        /// Of this firmware.
        expected: u8,
    },
    /// From the store, or a value of the configuration.
    #[error(transparent)]
    Store(StoreError),
    /// From the weight slots.
    #[error(transparent)]
    Slot(SlotError),
    /// Nothing has been found that could be stored.
    #[error("no calibration has been found that could be stored")]
    NothingFound,
    /// The vehicle is not proven to stand: writing the flash would interrupt the output.
    #[error("the vehicle is not proven to stand still")]
    Moving,
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

/// Where a record comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Origin {
    /// Built in: nothing is stored.
    BuiltIn,
    /// From flash.
    Stored,
    /// Built in: what is stored is refused.
    Refused(StoreError),
}

/// What the board knows of itself when it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Of the firmware.
    pub firmware: [u8; 3],
    /// DBGMCU_IDCODE; `None` where it reads as zero, as in the emulator.
    pub device_id: Option<u32>,
    /// Of the processor, Hz.
    pub clock_hz: u32,
    /// Why the clock is not the crystal's; `None`: it is.
    pub clock_fault: Option<ClockFault>,
    /// Why frames go out as SLCAN alone; `None`: they go out on CAN too.
    pub can_fault: Option<CanFault>,
    /// Why it has started.
    pub reset: ResetCause,
    /// Its last crash since power came on.
    pub crash: Option<Crash>,
}

impl Identity {
    /// Before anything is known.
    pub const UNKNOWN: Self = Self {
        firmware: [0; 3],
        device_id: None,
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

/// What the board is and how it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`PROTOCOL`].
    pub protocol: u8,
    /// Known since the start.
    pub identity: Identity,
    /// Layout of the configuration and of the calibration.
    pub record_versions: [u8; 2],
    /// What is stored.
    pub flash: FlashState,
    /// Whether a controller answers, so that something can be stored; the emulator has none.
    pub writable: bool,
    /// Of the configuration.
    pub configuration: Origin,
    /// Of the calibration.
    pub calibration: Origin,
    /// The weights that the network runs on.
    pub weights: WeightSource,
    /// Their checksum.
    pub weights_crc: Option<u32>,
    /// Why the sensor could not be set up, where the board does so.
    pub sensor: Option<SensorFault>,
    /// Why each slot that should be used is not.
    pub refused_slots: [Option<SlotError>; 2],
    /// Of the corrected yaw rate.
    pub status: Status,
}

/// Everything that is counted since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct AllCounters {
    /// Of the pipeline.
    pub pipeline: Counters,
    /// Of the sensor monitor.
    pub watch: WatchCounters,
    /// Of the lines.
    pub lines: LineCounters,
    /// Of the fibre-optic gyro.
    pub fog: FogCounters,
    /// Of the coprocessor's inputs.
    pub inputs: InputCounters,
}

/// What went wrong on the lines.
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
    /// Service frames that were none.
    pub service_errors: u32,
    /// Frames of the CAN bus that passed the filters and found no room.
    pub frames_lost: u32,
}

impl LineCounters {
    /// Nothing yet.
    pub const NONE: Self =
        Self { unsent: 0, line_errors: 0, held: 0, overruns: 0, service_errors: 0, frames_lost: 0 };
}
