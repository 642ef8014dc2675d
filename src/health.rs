//! What the board thinks of itself: status, source and one counter for each kind of event.

use serde::{Deserialize, Serialize};

/// State of the corrected yaw rate.
///
/// | status | when | yaw rate on CAN |
/// |---|---|---|
/// | `Init` | until static initialisation has succeeded | raw gyro, marked initialising |
/// | `Degraded` | bias known, no believable window yet, or a gap or clipping broke it | gyro less bias |
/// | `Ready` | a believable window covers the recent samples | gyro less bias and correction |
/// | `Clipped` | the part says that it is saturated | marked failed |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Status {
    /// No bias yet: the rate is shown but not good.
    #[default]
    Init,
    /// Corrected by the network.
    Ready,
    /// Corrected by static bias only.
    Degraded,
    /// The part is saturated: the rate is wrong.
    Clipped,
}

/// How often each kind of event happened since start. They saturate, they do not wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Samples that became frames.
    pub samples: u32,
    /// Grid steps that no sample filled.
    pub missing: u32,
    /// Samples refused: duplicate, backwards or off the grid.
    pub misplaced: u32,
    /// The clock jumped by more than a second.
    pub clock_jumps: u32,
    /// Samples that the part marked as clipped.
    pub clipped: u32,
    /// Static initialisations refused because the vehicle moved.
    pub moving: u32,
    /// Windows that the network has run.
    pub windows: u32,
    /// Network inputs clamped to its range.
    pub clamped_inputs: u32,
    /// Windows not believed.
    pub implausible: u32,
    /// Windows whose estimate came too late or not at all.
    pub late: u32,
    /// Rates beyond what the CAN signal can hold.
    pub out_of_range: u32,
}

/// Adds to a counter without wrapping.
pub fn count(counter: &mut u32, by: u32) {
    *counter = counter.saturating_add(by);
}
