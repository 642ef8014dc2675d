//! The monitor judges each reading of the inertial sensor and detects silence.
//!
//! A part can fail in ways that no single sample shows: it becomes silent, repeats its readings, or has just been
//! saturated. `gyronet reference states` prints the faults. Time is by an outside clock: the part's may stop.

mod readings;

pub use readings::{AXIS_STUCK_AFTER, JUMP_FORCE, JUMP_PATIENCE, JUMP_RATE, STUCK_AFTER, USUAL};

use crate::align::clock_ratio::{ClockRatio, RatioEstimator};
use crate::health::{MonitorCounters, count};
use crate::sample::{ImuSample, PERIOD_US, Validity};
use crate::units::Micros;
use readings::{Jump, Repeats};

/// Silence that counts, us: two samples are missing, and it is reported before the third would come.
pub const TIMEOUT_US: u64 = 29_000;
/// The same after the start, us: an MTi needs about a second before it sends.
pub const START_US: u64 = 2_000_000;
/// Samples after saturation that are not used: 50 ms, in which the part's filter recovers.
pub const HOLD: u8 = 5;

/// Rate at which arrivals may become later without being late, parts of 16: a sensor's clock that is 6 % slow.
const CREEP: u64 = 16;
/// Part of the time by which the slowest clock that is used falls behind: 4 %.
const SLOW: u64 = 25;
/// Arrivals that vary by less are in time, microseconds.
const IN_TIME_US: u64 = 5_000;
/// Late arrivals are a new normal after this time, microseconds.
const PATIENCE_US: u64 = 1_000_000;

#[derive(Debug, Clone, Copy, Default)]
struct Arrivals {
    /// Time stamp of the newest sample, and the least time from stamp to arrival, which creeps up.
    newest: Option<(u64, i64)>,
    /// Arrival of the first late sample, and the time stamp of the one before.
    late_since: Option<(u64, u64)>,
}

impl Arrivals {
    /// Returns by how much a sample is later than the least late ones, and what the sensor's clock has lost if all are
    /// for a second, by more than a slow clock explains (a counter that has wrapped unseen), us.
    fn late(&mut self, time: Micros, now: Micros) -> (u64, u64) {
        let measured = (now.0 as i64).wrapping_sub(time.0 as i64);
        let (last, before) = self.newest.unwrap_or((time.0, measured));
        // While samples are late nothing creeps up, or the lost time would look like a slow clock before patience ends.
        let creep = if self.late_since.is_some() { 0 } else { time.0.saturating_sub(last) / CREEP };
        let expected = before.saturating_add(creep as i64);
        let late = measured.saturating_sub(expected).max(0) as u64;
        self.late_since =
            if late > TIMEOUT_US { Some(self.late_since.unwrap_or((now.0, last))) } else { None };
        if let Some((since, stamp)) = self.late_since
            && now.0.saturating_sub(since) > PATIENCE_US
        {
            (self.newest, self.late_since) = (Some((time.0, measured)), None);
            // A stall of seconds, in which a slow clock has fallen behind, loses nothing.
            let is_slow = late <= time.0.saturating_sub(stamp) / SLOW;
            return (0, if is_slow { 0 } else { late });
        }
        self.newest = Some((time.0, expected.min(measured)));
        (late, 0)
    }
}

#[derive(Debug, Clone)]
pub struct SensorMonitor {
    repeats: Repeats,
    jump: Jump,
    stuck: bool,
    recovering: u8,
    /// Time stamp and arrival of the newest sample that was used.
    newest: Option<(Micros, Micros)>,
    arrivals: Arrivals,
    /// The time by which the newest sample came late, microseconds; 0 where it came in time.
    pub late: u32,
    /// The time from which silence is counted: of that arrival, or of a later look at samples that wait.
    heard: Option<Micros>,
    /// The time at which the next message set without a sample is due.
    due: Option<u64>,
    clock: Option<RatioEstimator>,
    pub counters: MonitorCounters,
}

impl SensorMonitor {
    pub const fn new(clock_is_exact: bool) -> Self {
        Self {
            repeats: Repeats::new(),
            jump: Jump::new(),
            stuck: false,
            recovering: 0,
            newest: None,
            arrivals: Arrivals { newest: None, late_since: None },
            late: 0,
            heard: None,
            due: None,
            clock: if clock_is_exact { Some(RatioEstimator::START) } else { None },
            counters: MonitorCounters::NONE,
        }
    }

    /// Judges a sample. Call it once for each sample, in order of arrival.
    pub fn judge(&mut self, sample: &ImuSample) -> Validity {
        let stuck = self.repeats.observe(sample);
        let began = !core::mem::replace(&mut self.stuck, stuck) && stuck;
        count(&mut self.counters.stuck, u32::from(began));
        let saturated = !sample.validity.is_good();
        self.recovering = if saturated { HOLD + 1 } else { self.recovering.saturating_sub(1) };
        let recovering = !saturated && self.recovering > 0;
        count(&mut self.counters.held, u32::from(recovering));
        // A saturated reading, or one soon after it, is no reference for others.
        let implausible = !saturated && !recovering && self.jump.check(sample);
        count(&mut self.counters.wrong, u32::from(implausible));
        match (saturated, stuck, recovering, implausible) {
            (true, ..) => sample.validity,
            (_, true, ..) => Validity::Stuck,
            (_, _, true, _) => Validity::Recovering,
            (.., true) => Validity::Implausible,
            _ => Validity::Good,
        }
    }

    /// Notes that a sample arrives at `now` by an outside clock; returns what the sensor's clock has lost, us.
    pub fn arrives(&mut self, time: Micros, now: Micros) -> u64 {
        let (late, lost) = self.arrivals.late(time, now);
        self.late = if late > IN_TIME_US { late.min(u64::from(u32::MAX)) as u32 } else { 0 };
        lost
    }

    /// Returns the yaw rate by which the readings may be off since a jump, rad/s.
    pub fn shift(&self) -> f32 {
        self.jump.shift()
    }

    /// Returns the mean rate of a second by which readings may be off that are unusual and still plausible, rad/s.
    pub fn suspect(&self) -> f32 {
        self.jump.suspect()
    }

    /// Notes that the readings are those of a vehicle that stands: whatever has jumped is right.
    pub fn settle(&mut self) {
        self.jump.settle();
    }

    /// Notes that a sample with time stamp `time` arrived at `now` and was used.
    pub fn heard(&mut self, time: Micros, now: Micros) {
        self.newest = Some((time, now));
        self.heard = Some(now);
        self.due = None;
        if let Some(clock) = &mut self.clock {
            let before = clock.fault;
            clock.observe(time, now);
            count(&mut self.counters.clock_off, u32::from(!before && clock.fault));
        }
    }

    /// Returns the true length of a step of the sensor's clock, as the samples so far show it.
    pub fn clock_ratio(&self) -> ClockRatio {
        self.clock.as_ref().map_or(ClockRatio::ONE, |clock| clock.ratio)
    }

    pub fn is_clock_off(&self) -> bool {
        self.clock.as_ref().is_some_and(|clock| clock.fault)
    }

    /// Returns whether the newest sample is so old that its reading says nothing about `now`.
    pub fn is_stale(&self, now: Micros) -> bool {
        let arrival = self.newest.map_or(0, |(_, arrival)| arrival.0);
        now.0.saturating_sub(arrival) >= TIMEOUT_US
    }

    /// Returns the sensor's time at `now`, as if its clock had gone on since the newest sample.
    pub fn time_at(&self, now: Micros) -> Micros {
        let (time, arrival) = self.newest.unwrap_or_default();
        Micros(time.0.saturating_add(now.0.saturating_sub(arrival.0)))
    }

    /// Notes that samples are waiting to be read, so the sensor is not silent.
    pub fn hold(&mut self, now: Micros) {
        self.heard = self.heard.and(Some(now));
    }

    /// Returns the steps since the newest message set when a set without a sample is due: call it every ms.
    pub fn poll(&mut self, now: Micros) -> Option<u32> {
        let due = match (self.due, self.heard) {
            (Some(due), _) => due,
            (None, Some(heard)) => heard.0.saturating_add(TIMEOUT_US),
            (None, None) => START_US,
        };
        if now.0 < due {
            return None;
        }
        let first = self.due.is_none();
        count(&mut self.counters.silences, u32::from(first));
        // Missed message sets are not sent later, because late ones are useless.
        self.due = Some(now.0.saturating_add(PERIOD_US));
        Some(if first { TIMEOUT_US.div_ceil(PERIOD_US) as u32 } else { 1 })
    }
}
