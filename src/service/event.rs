//! The event log holds what has happened to the board, until it is overwritten.

use super::calibrate::CalibrationFault;
pub use super::crash::{Crash, CrashKind};
pub use super::hardware::{CanFault, ClockFault};
use crate::health::Status;
use crate::store::{Place, Slot, StoreError, slots::SlotError};
use heapless::{Deque, Vec};
use serde::{Deserialize, Serialize};

/// Events that are kept.
pub const KEPT: usize = 32;
/// Events of one page.
pub const PAGE: usize = 8;

/// The cause of the processor's start, as its reset flags report it (RM0090 7.3.21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ResetCause {
    /// No flag is set: the emulator has none.
    Unknown,
    /// Power came on.
    PowerOn,
    /// Power was too low.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The board was restarted by a request or by a crash: see [`Crash`].
    Software,
    /// A watchdog.
    Watchdog,
    /// A forbidden low-power mode.
    LowPower,
}

/// The reason why a part on SPI gives no samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorFault {
    /// The controller did not answer.
    Bus,
    /// The part did not come back from its reset.
    Reset,
    /// Another part answers, or none (0 or 255): its identity.
    Identity(u8),
    /// A register does not hold what was written.
    Setting {
        /// The address of the register.
        bank: u8,
        /// The address in the bank.
        address: u8,
        /// The bits that it holds.
        got: u8,
    },
}

/// The kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EventKind {
    /// The image started.
    Started(ResetCause),
    /// It had crashed before.
    Crashed(Crash),
    /// The stored configuration is not used; the defaults are.
    ConfigurationRefused(StoreError),
    /// The stored wheel settings are not used; the built-in ones are.
    WheelsRefused(StoreError),
    /// The stored calibration is not used.
    CalibrationRefused(StoreError),
    /// The record of accepted weights is not used.
    AcceptedRefused(StoreError),
    /// A weight slot is not used.
    SlotRefused(Slot, SlotError),
    /// FoGNet's weights are not used.
    FogNetRefused(SlotError),
    /// No weights are good: the network is off.
    NoWeights,
    /// The status has changed.
    Status(Status),
    /// A configuration was stored.
    ConfigurationStored,
    /// Wheel settings were stored.
    WheelsStored,
    /// A calibration was stored.
    CalibrationStored,
    /// A calibration ended; with why it found nothing.
    Calibrated(Option<CalibrationFault>),
    /// The file in a place was accepted.
    WeightsAccepted(Place),
    /// The weights in use no longer fit their checksum: the network is off.
    WeightsDamaged,
    /// Stored records are damaged: what is used is older, or built in.
    RecordsDamaged,
    /// The part on SPI was set up; or why not: it is tried again every second.
    Sensor(Option<SensorFault>),
    /// The memory of troubles could not be read or stored.
    TroublesRefused(StoreError),
    /// The record of who may write could not be read: nobody may.
    AccessRefused(StoreError),
    /// A key was stored, or another one: from now on what is written must be signed.
    KeyStored,
    /// The key was removed: everyone may write.
    KeyRemoved,
    /// What the board had learnt about its sensor could not be read or stored.
    LearnedRefused(StoreError),
    /// What the board has learnt about its sensor was stored.
    LearnedStored,
    /// The sensor is mounted otherwise than in earlier drives.
    MountMoved,
    /// The start could not make room for new records.
    NoRoom(StoreError),
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// Counted from 1 since the start.
    pub number: u32,
    /// 10 ms steps of the sensor's time.
    pub tick: u32,
    /// The event.
    pub kind: EventKind,
}

/// A part of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogPage {
    /// The events in order.
    pub events: Vec<Event, PAGE>,
    /// Events since the start.
    pub total: u32,
    /// The number of requested events that were overwritten before.
    pub lost: u32,
}

/// The newest events; the oldest one gives way.
#[derive(Debug, Default)]
pub(crate) struct EventLog {
    events: Deque<Event, KEPT>,
    total: u32,
}

impl EventLog {
    /// Makes an empty log.
    #[must_use]
    pub const fn new() -> Self {
        Self { events: Deque::new(), total: 0 }
    }

    /// Notes an event, and with feature `defmt` logs it.
    pub fn record(&mut self, tick: u32, kind: EventKind) {
        self.total = self.total.saturating_add(1);
        if self.events.is_full() {
            self.events.pop_front();
        }
        let event = Event { number: self.total, tick, kind };
        #[cfg(feature = "defmt")]
        defmt::info!("{}", event);
        // There is room.
        let _ = self.events.push_back(event);
    }

    /// Returns a page of the events after number `after`.
    #[must_use]
    pub fn page(&self, after: u32) -> LogPage {
        let oldest = self.events.front().map_or(1, |event| event.number);
        let mut events = Vec::new();
        for event in self.events.iter().filter(|event| event.number > after).take(PAGE) {
            // There is room for a page.
            let _ = events.push(*event);
        }
        let lost = oldest.saturating_sub(after.saturating_add(1));
        LogPage { events, total: self.total, lost }
    }
}
