//! This type gathers the present faults of the board for the memory of troubles.

use crate::health::{Faults, Status};

/// Holds the present faults and the state in which they are.
#[derive(Debug, Clone, Copy, Default)]
pub struct Conditions {
    /// 10 ms steps of the sensor's time since the start.
    pub tick: u32,
    /// Status of the yaw rate.
    pub status: Status,
    /// Its fault bits.
    pub faults: Faults,
    /// The network runs on no weights.
    pub no_weights: bool,
    /// The inertial sensor could not be set up.
    pub sensor_refused: bool,
    /// The board does not run on its crystal.
    pub clock_fault: bool,
    /// The CAN controller does not take part in the bus.
    pub can_fault: bool,
    /// The last start followed a crash.
    pub crashed: bool,
    /// The last request was refused for want of access.
    pub access_refused: bool,
}
