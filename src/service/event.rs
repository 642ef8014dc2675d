//! The event log holds the newest events of the board.

pub use super::crash::{Crash, CrashKind};
pub use super::hardware::{CanFault, ClockFault};
use crate::health::Status;
use crate::store::{FlashFault, Slot, StoreError, slots::SlotError};
use heapless::{Deque, Vec};
use serde::{Deserialize, Serialize};

/// Number of events that the log holds.
pub const KEPT: usize = 32;
/// Largest number of events in a page.
pub const PAGE: usize = 8;

/// The cause of the last reset, from the reset flags (RM0090 7.3.21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ResetCause {
    /// No flag is set.
    Unknown,
    /// Power-on reset.
    PowerOn,
    /// The supply voltage was too low.
    BrownOut,
    /// Reset pin.
    Pin,
    /// Software reset, by a request or after a crash (see [`Crash`]).
    Software,
    /// Watchdog reset.
    Watchdog,
    /// Reset by a forbidden low-power mode.
    LowPower,
}

/// The reason why a sensor could not be set up or read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorFault {
    /// The SPI controller did not answer.
    Bus,
    /// The sensor did not complete its reset.
    Reset,
    /// The sensor says that its self-test has failed.
    SelfTest,
    /// The sensor sends messages with this identifier, and none that can be read.
    Foreign(u8),
    /// The identity that was read is not that of the sensor; 0 or 255: nothing answers.
    Identity(u8),
    /// A register does not hold the value that was written.
    Setting {
        /// Bank of the register.
        bank: u8,
        /// Address of the register in its bank.
        address: u8,
        /// Bits that the register holds.
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
    /// The last start followed a crash.
    Crashed(Crash),
    /// The stored configuration was refused; the default is used.
    ConfigurationRefused(StoreError),
    /// The stored wheel settings were refused; the built-in ones are used.
    WheelsRefused(StoreError),
    /// The stored calibration was refused.
    CalibrationRefused(StoreError),
    /// The record of accepted weights was refused.
    AcceptedRefused(StoreError),
    /// The file in a weight slot was refused.
    SlotRefused(Slot, SlotError),
    /// No weights are valid: the network is off.
    NoWeights,
    /// The status of the yaw rate has changed.
    Status(Status),
    /// A configuration was stored.
    ConfigurationStored,
    /// Wheel settings were stored.
    WheelsStored,
    /// A calibration was stored.
    CalibrationStored,
    /// The weight file in this slot was accepted.
    WeightsAccepted(Slot),
    /// Firmware in this slot starts on trial at the next start.
    FirmwareStored(Slot),
    /// The firmware has shown that it works, and is confirmed.
    FirmwareConfirmed(Slot),
    /// A newer firmware, in the other slot, does not run: its trial has failed, or it is damaged.
    FirmwareRefused(Slot),
    /// The weights in use no longer match their checksum: the network is off.
    WeightsDamaged,
    /// Stored records are damaged: older or built-in ones are used.
    RecordsDamaged,
    /// The sensor on SPI was set up (`None`), or could not be; the board tries again every second.
    Sensor(Option<SensorFault>),
    /// The trouble memory could not be read or stored.
    TroublesRefused(StoreError),
    /// The access record could not be read: nobody may write.
    AccessRefused(StoreError),
    /// A key was stored or replaced: from now on written data must be signed.
    KeyStored,
    /// The key was removed: everyone may write.
    KeyRemoved,
    /// The record of what was learnt about the sensor could not be read or stored.
    LearnedRefused(StoreError),
    /// The record of what was learnt about the sensor was stored.
    LearnedStored,
    /// The mounting of the sensor has changed since earlier drives.
    MountMoved,
    /// At the start, no room could be made for new records.
    NoRoom(StoreError),
    /// The flash controller is not in order at the start: nothing is written.
    FlashRefused(FlashFault),
}

/// An entry of the event log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// Number of the event, from 1 at the start.
    pub number: u32,
    /// Sensor time, 10 ms steps.
    pub tick: u32,
    /// Kind of event.
    pub kind: EventKind,
}

/// A page of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogPage {
    /// Events in order.
    pub events: Vec<Event, PAGE>,
    /// Number of events since the start.
    pub total: u32,
    /// Number of requested events that have been overwritten.
    pub lost: u32,
}

/// The event log; when it is full, the oldest event is dropped.
#[derive(Debug, Default)]
pub(crate) struct EventLog {
    events: Deque<Event, KEPT>,
    total: u32,
}

impl EventLog {
    /// Creates an empty log.
    pub const fn new() -> Self {
        Self { events: Deque::new(), total: 0 }
    }

    /// Appends an event.
    pub fn record(&mut self, tick: u32, kind: EventKind) {
        self.total = self.total.saturating_add(1);
        if self.events.is_full() {
            self.events.pop_front();
        }
        let event = Event { number: self.total, tick, kind };
        // Cannot fail: the log has room now.
        let _ = self.events.push_back(event);
    }

    /// Returns a page of the events after number `after`.
    pub fn page(&self, after: u32) -> LogPage {
        let oldest = self.events.front().map_or(1, |event| event.number);
        let mut events = Vec::new();
        for event in self.events.iter().filter(|event| event.number > after).take(PAGE) {
            // Cannot fail: at most a page of events is taken.
            let _ = events.push(*event);
        }
        let lost = oldest.saturating_sub(after.saturating_add(1));
        LogPage { events, total: self.total, lost }
    }
}
