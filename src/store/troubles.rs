//! The troubles that a workshop has not cleared yet are a stored record, so that a restart does not hide them.

use super::error::FieldError;
use super::record::Record;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most troubles of a record.
pub const MOST_TROUBLES: usize = 16;

/// The state of the board when a trouble came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Snapshot {
    /// 10 ms steps of the sensor's time since the start.
    pub tick: u32,
    /// Status of the yaw rate, as on CAN.
    pub status: u8,
    /// Fault bits, as on CAN.
    pub faults: u8,
}

/// A trouble in the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredTrouble {
    /// Its code, three bytes.
    pub code: u32,
    /// Times that it came since the memory was cleared; it stays at 255.
    pub occurrences: u8,
    /// The state when it came first.
    pub snapshot: Snapshot,
}

/// Holds the confirmed troubles.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Troubles {
    /// Each at most once.
    pub confirmed: Vec<StoredTrouble, MOST_TROUBLES>,
}

impl Troubles {
    /// No trouble is confirmed.
    pub const NONE: Self = Self { confirmed: Vec::new() };
}

impl Record for Troubles {
    const KEY: u8 = 5;
    const VERSION: u8 = 1;

    /// Any value is a state that the board can have had.
    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}
