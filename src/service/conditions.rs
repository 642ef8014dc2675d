//! Defines the fault conditions that the trouble memory observes.

use crate::health::{Faults, Status};

/// The present faults of the board, and its state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Conditions {
    /// Sensor time since the start, 10 ms steps.
    pub tick: u32,
    /// Status of the yaw rate.
    pub status: Status,
    /// Fault bits of the yaw rate.
    pub faults: Faults,
    /// GyroNet has no valid weights.
    pub no_weights: bool,
    /// The inertial sensor could not be set up.
    pub sensor_refused: bool,
    /// The processor does not run on its crystal.
    pub clock_fault: bool,
    /// The CAN controller did not start.
    pub can_fault: bool,
    /// The last start followed a crash.
    pub crashed: bool,
    /// Courses contradict the gyro.
    pub course_contradicts: bool,
    /// The configured source of courses is silent.
    pub course_silent: bool,
    /// The rate has not been good for long, although no fault says why.
    pub not_good_for_long: bool,
    /// The newest firmware does not run.
    pub firmware_refused: bool,
    /// The last request was refused for lack of access.
    pub access_refused: bool,
}
