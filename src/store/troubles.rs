//! The record of the troubles that a workshop has not cleared yet, so that they survive a restart.

use super::record::Record;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Capacity of the record.
pub const MAX_TROUBLES: usize = 19;

/// The state of the board when a trouble first appeared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Snapshot {
    /// Sensor time since the start, 10 ms steps.
    pub tick: u32,
    /// Status of the yaw rate, as on CAN.
    pub status: u8,
    /// Fault bits, as on CAN.
    pub faults: u8,
}

/// A stored trouble.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredTrouble {
    /// Code of the trouble, three bytes.
    pub code: u32,
    /// Number of times that the fault has appeared since the memory was cleared; saturates at 255.
    pub occurrences: u8,
    /// State of the board when the fault first appeared.
    pub snapshot: Snapshot,
    /// True if the fault was present in the last operation cycle that tested it.
    pub pending: bool,
}

/// The confirmed troubles.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Troubles {
    /// Confirmed troubles, each at most once.
    pub confirmed: Vec<StoredTrouble, MAX_TROUBLES>,
}

impl Troubles {
    /// Record without troubles.
    pub const NONE: Self = Self { confirmed: Vec::new() };
}

impl Record for Troubles {
    const KEY: u8 = 5;
    const VERSION: u8 = 2;
}
