//! The trouble memory holds the faults that the board has had, for a workshop to read (ISO 14229-1 D.2).
//!
//! A fault is confirmed at once, because the pipeline has debounced it, and stays until a tester clears it, also after
//! a restart. It stays pending through the next cycle; one without it for [`PASSED_TICKS`] ends that. `gyronet
//! reference troubles` prints [`TROUBLES`].

use crate::health::{Faults, Status};
use crate::service::Conditions;
use crate::store::{MAX_TROUBLES, Snapshot, StoredTrouble, Troubles};

/// The bits of a trouble's status.
pub mod bit {
    pub const FAILED: u8 = 1;
    pub const FAILED_THIS_CYCLE: u8 = 1 << 1;
    /// The fault has been present in this operation cycle, which begins at the start, or in the one before.
    pub const PENDING: u8 = 1 << 2;
    pub const CONFIRMED: u8 = 1 << 3;
    pub const UNTESTED_SINCE_CLEAR: u8 = 1 << 4;
    pub const FAILED_SINCE_CLEAR: u8 = 1 << 5;
    pub const UNTESTED_THIS_CYCLE: u8 = 1 << 6;
    /// Mask of the bits that this server supports.
    pub const AVAILABLE: u8 = 0x7F;
}

/// Length of an operation cycle without a fault that counts as passed, 10 ms: the flash is not written at each start.
pub const PASSED_TICKS: u32 = 6_000;

#[derive(Debug)]
pub struct Trouble {
    /// Code (ISO 15031-6) and failure type, three bytes.
    pub code: u32,
    pub name: &'static str,
    pub check: &'static str,
    cause: Cause,
}

impl Trouble {
    /// Returns the code as a workshop reads it (SAE J2012-DA), such as `C1A01-31`.
    pub fn display(&self) -> impl core::fmt::Display {
        let system = ['P', 'C', 'B', 'U'][(self.code >> 22 & 3) as usize];
        let (code, failure) = (self.code >> 8 & 0x3FFF, self.code as u8);
        core::fmt::from_fn(move |f| write!(f, "{system}{code:04X}-{failure:02X}"))
    }
}

#[derive(Debug, Clone, Copy)]
enum Cause {
    Status(Status),
    Fault(Faults),
    SensorRefused,
    NoWeights,
    Crash,
    Clock,
    Can,
    Course,
    NoCourse,
    NoBias,
    NotGood,
    AccessRefused,
    Firmware,
}

impl Cause {
    /// Returns whether a stall of the processor, as by an erase, causes this, too: what would have arrived is lost.
    fn follows_stall(self) -> bool {
        match self {
            Self::Status(status) => status == Status::Silent,
            Self::Fault(fault) => Faults::GAP.with(Faults::BUS).with(Faults::WHEELS).contains(fault),
            _ => false,
        }
    }

    fn is_present(self, now: &Conditions) -> bool {
        match self {
            Self::Status(status) => now.status == status,
            Self::Fault(fault) => now.faults.contains(fault),
            Self::SensorRefused => now.sensor_refused,
            Self::NoWeights => now.no_weights,
            Self::Crash => now.crashed,
            Self::Clock => now.clock_fault,
            Self::Can => now.can_fault,
            Self::Course => now.course_contradicts,
            Self::NoCourse => now.course_silent,
            Self::NoBias => now.not_good_for_long && now.status == Status::Init,
            Self::NotGood => now.not_good_for_long && now.status != Status::Init,
            Self::AccessRefused => now.access_refused,
            Self::Firmware => now.firmware_refused,
        }
    }
}

pub static TROUBLES: [Trouble; 19] = [
    trouble(
        0x5A0131,
        "inertial sensor: no signal",
        "supply and wires of the sensor, setting `imu`",
        Cause::Status(Status::Silent),
    ),
    trouble(0x5A012A, "inertial sensor: readings are stuck", "the sensor", Cause::Status(Status::Stuck)),
    trouble(
        0x5A0122,
        "inertial sensor: saturated",
        "its range, its mechanical mounting",
        Cause::Status(Status::Clipped),
    ),
    trouble(
        0x5A0162,
        "inertial sensor: implausible, or its clock or rate is off",
        "its output rate (50 to 1000 Hz), the mounting, settings `mounting`",
        Cause::Fault(Faults::IMPLAUSIBLE),
    ),
    trouble(
        0x5A0149,
        "inertial sensor: could not be set up or read, or its self-test has failed",
        "`device info` has the reason: wires of SPI, the sensor's output messages",
        Cause::SensorRefused,
    ),
    trouble(
        0x5A0138,
        "inertial sensor: samples are missing",
        "its wires, its output rate",
        Cause::Fault(Faults::GAP),
    ),
    trouble(
        0x5A0154,
        "yaw rate: no bias in ten minutes of driving",
        "let it stand for 3 s; limits in `static_init`; a course on the bus",
        Cause::NoBias,
    ),
    trouble(
        0x5A0192,
        "yaw rate: degraded for ten minutes of driving, without a fault",
        "0x1A3: a coarse bias needs another stop; `device counters`: late or missing windows",
        Cause::NotGood,
    ),
    trouble(
        0x5A0244,
        "stored data are damaged",
        "`device info` says which; store the missing data again",
        Cause::Fault(Faults::STORED),
    ),
    trouble(0x5A0246, "no weights that can be used", "`device info`; upload weights", Cause::NoWeights),
    trouble(0x5A0347, "the software crashed", "`device info` has the reason", Cause::Crash),
    trouble(
        0x5A0352,
        "the firmware update was rolled back, or is damaged",
        "what `device info` says of the firmware; update again",
        Cause::Firmware,
    ),
    trouble(0x5A0338, "the processor's clock is not the crystal's", "the crystal", Cause::Clock),
    trouble(
        0xDA0188,
        "CAN: no bus, or frames were lost",
        "wires, terminators, bit rate",
        Cause::Fault(Faults::BUS),
    ),
    trouble(
        0xDA0149,
        "CAN: the controller does not start, or no node takes CAN FD",
        "`device info` has the reason: the transceiver, setting `can.yaw.fd`",
        Cause::Can,
    ),
    trouble(
        0xDA0287,
        "wheels: silent, or they contradict the gyro",
        "wheel frames, radius, slip",
        Cause::Fault(Faults::WHEELS),
    ),
    trouble(
        0xDA0462,
        "course: contradicts the gyro",
        "the GNSS receiver, its antenna; who else sends courses",
        Cause::Course,
    ),
    trouble(
        0xDA0487,
        "course: its source is silent",
        "the GNSS receiver, its wires, bit rate and messages; setting `heading`",
        Cause::NoCourse,
    ),
    trouble(
        0xDA0381,
        "diagnosis: a request was refused: no access",
        "the counters in data 0113",
        Cause::AccessRefused,
    ),
];

const _: () = assert!(TROUBLES.len() <= MAX_TROUBLES, "the record has room for all troubles");

/// Creates a trouble from code and failure type: 0x5A0131 is C1A01-31, 0xDA0188 is U1A01-88.
const fn trouble(code: u32, name: &'static str, check: &'static str, cause: Cause) -> Trouble {
    Trouble { code, name, check, cause }
}

#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Status bits: see [`bit`].
    pub status: u8,
    /// Number of times that the fault has appeared since the memory was cleared.
    pub occurrences: u8,
    /// State of the board when the fault first appeared.
    pub snapshot: Snapshot,
    /// True if the stored trouble is to be pending at the next start.
    pending_next: bool,
}

const UNTESTED: Entry = Entry {
    status: bit::UNTESTED_SINCE_CLEAR | bit::UNTESTED_THIS_CYCLE,
    occurrences: 0,
    pending_next: false,
    snapshot: Snapshot { tick: 0, status: 0, faults: 0 },
};

impl From<&Conditions> for Snapshot {
    fn from(now: &Conditions) -> Self {
        Self { tick: now.tick, status: now.status as u8, faults: now.faults.0 }
    }
}

/// The trouble memory: an entry for each of [`TROUBLES`].
#[derive(Debug)]
pub struct Memory {
    entries: [Entry; TROUBLES.len()],
    /// True if troubles are recorded; a tester may stop the recording.
    pub is_enabled: bool,
    /// True if the confirmed troubles differ from the stored ones.
    pub is_changed: bool,
    /// What was observed last, and whether there was a stall; `None` once an entry was changed otherwise.
    observed: Option<(Conditions, bool)>,
}

impl Memory {
    pub const START: Self =
        Self { entries: [UNTESTED; TROUBLES.len()], is_enabled: true, is_changed: false, observed: None };

    /// As [`Self::observe`], and does nothing where nothing has changed since.
    pub fn observe_changes(&mut self, now: &Conditions, has_stalled: bool) {
        // Of the tick it matters alone whether the cycle has passed.
        let seen = (Conditions { tick: now.tick.min(PASSED_TICKS), ..*now }, has_stalled);
        let is_like = |last: &(Conditions, bool)| {
            last.0.tick / PASSED_TICKS == seen.0.tick / PASSED_TICKS
                && (Conditions { tick: seen.0.tick, ..last.0 }, last.1) == seen
        };
        if !self.is_enabled || self.observed.as_ref().is_some_and(is_like) {
            return;
        }
        self.observed = Some(seen);
        self.observe(now, has_stalled);
    }

    /// Records the faults that are present now, but for those that a stall of the processor causes where there was one.
    pub fn observe(&mut self, now: &Conditions, has_stalled: bool) {
        if !self.is_enabled {
            return;
        }
        let entries = TROUBLES.iter().zip(&mut self.entries);
        for (trouble, entry) in entries.filter(|(trouble, _)| !has_stalled || !trouble.cause.follows_stall())
        {
            entry.status &= !(bit::UNTESTED_SINCE_CLEAR | bit::UNTESTED_THIS_CYCLE);
            let was_present = entry.status & bit::FAILED != 0;
            let is_present = trouble.cause.is_present(now);
            if is_present && !was_present {
                entry.occurrences = entry.occurrences.saturating_add(1);
                if entry.status & bit::CONFIRMED == 0 {
                    entry.snapshot = now.into();
                }
                self.is_changed |= !core::mem::replace(&mut entry.pending_next, true);
                entry.status |= bit::FAILED
                    | bit::FAILED_THIS_CYCLE
                    | bit::PENDING
                    | bit::CONFIRMED
                    | bit::FAILED_SINCE_CLEAR;
            } else if !is_present {
                entry.status &= !bit::FAILED;
                let has_passed = entry.status & bit::FAILED_THIS_CYCLE == 0 && now.tick >= PASSED_TICKS;
                if has_passed && entry.pending_next {
                    entry.pending_next = false;
                    self.is_changed = true;
                }
            }
        }
    }

    /// Clears one trouble, or all for `0xFF_FFFF`. Returns whether the code is known.
    pub fn clear(&mut self, code: u32) -> bool {
        let mut found = false;
        self.observed = None;
        for (trouble, entry) in TROUBLES.iter().zip(&mut self.entries) {
            if code == 0xFF_FFFF || code == trouble.code {
                self.is_changed |= entry.status & bit::CONFIRMED != 0;
                *entry = UNTESTED;
                found = true;
            }
        }
        found
    }

    /// Restores the troubles that were stored before the start; codes that this firmware does not have are ignored.
    pub fn restore(&mut self, stored: &Troubles) {
        self.observed = None;
        for (trouble, entry) in TROUBLES.iter().zip(&mut self.entries) {
            let found = stored.confirmed.iter().find(|stored| stored.code == trouble.code);
            if let Some(StoredTrouble { occurrences, snapshot, pending, .. }) = found {
                entry.status = bit::CONFIRMED | bit::FAILED_SINCE_CLEAR | bit::UNTESTED_THIS_CYCLE;
                entry.status |= if *pending { bit::PENDING } else { 0 };
                (entry.occurrences, entry.snapshot, entry.pending_next) = (*occurrences, *snapshot, *pending);
            }
        }
    }

    pub fn confirmed(&self) -> Troubles {
        let mut troubles = Troubles::NONE;
        for (trouble, entry) in self.entries().filter(|(_, entry)| entry.status & bit::CONFIRMED != 0) {
            let Entry { occurrences, snapshot, pending_next: pending, .. } = *entry;
            // Cannot fail: the record has room for all troubles.
            let _ =
                troubles.confirmed.push(StoredTrouble { code: trouble.code, occurrences, snapshot, pending });
        }
        troubles
    }

    pub fn entries(&self) -> impl Iterator<Item = (&'static Trouble, &Entry)> {
        TROUBLES.iter().zip(&self.entries)
    }
}
