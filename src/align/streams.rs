//! This module puts an inertial sensor and a fibre-optic gyro, each with its own clock and rate, on one grid.
//!
//! Grid steps are the multiples of 10 ms of the board's clock. A step comes out as soon as both
//! streams have passed it, and [`MAX_DELAY_US`] after its time at the latest, with what there
//! is by then: no stream waits for the other without a bound. What comes later than that is
//! not used.

use super::clock::{ClockCounters, ClockError, PartClock};
use super::increments::{IncrementCounters, Increments, Turn};
use super::resample::{Quality, Resampler};
use crate::sample::{FogSample, ImuSample, PERIOD_US};
use crate::units::Micros;

/// The longest time that a step waits for a stream.
pub const MAX_DELAY_US: u64 = 10_000;
/// The silence after which the grid begins again, at the next step: one second.
pub const MAX_SILENCE_US: u64 = 1_000_000;

/// The numbers of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Events {
    /// The events of the inertial sensor's clock.
    pub imu: ClockCounters,
    /// The events of the fibre-optic gyro's clock.
    pub fog: ClockCounters,
    /// The events of its increments.
    pub increments: IncrementCounters,
}

impl Events {
    /// Starts without an event.
    pub const NONE: Self =
        Self { imu: ClockCounters::NONE, fog: ClockCounters::NONE, increments: IncrementCounters::NONE };
}

/// The values of one grid step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// Its time by the board's clock, a multiple of [`PERIOD_US`].
    pub time: Micros,
    /// The inertial sensor at that time.
    pub imu: Option<(ImuSample, Quality)>,
    /// The turn of the fibre-optic gyro since the step before.
    pub fog: Turn,
    /// The events since the step before; `samples` are those that have come.
    pub events: Events,
}

/// The streams that are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fitted {
    /// An inertial sensor.
    pub imu: bool,
    /// A fibre-optic gyro.
    pub fog: bool,
}

/// Both streams and the next step of the grid.
#[derive(Debug, Clone)]
pub struct Streams {
    fitted: Fitted,
    imu_clock: PartClock,
    fog_clock: PartClock,
    imu: Resampler,
    fog: Increments,
    /// The step that comes next; set by the first sample.
    next: Option<u64>,
    restarts: u32,
    /// The events up to the last step.
    reported: Events,
}

impl Streams {
    /// Begins before the first sample.
    #[must_use]
    pub const fn new(fitted: Fitted) -> Self {
        Self {
            fitted,
            imu_clock: PartClock::START,
            fog_clock: PartClock::START,
            imu: Resampler::EMPTY,
            fog: Increments::EMPTY,
            next: None,
            restarts: 0,
            reported: Events::NONE,
        }
    }

    /// Takes a sample of the inertial sensor that has arrived at `now`.
    ///
    /// # Errors
    /// [`ClockError`]: it is not used.
    pub fn add_imu(&mut self, now: Micros, sample: ImuSample) -> Result<(), ClockError> {
        let board = self.imu_clock.translate(sample.time, now)?;
        if board.jumped {
            self.imu.clear();
        }
        self.begin(board.time);
        self.imu.add(ImuSample { time: board.time, ..sample });
        Ok(())
    }

    /// Takes a sample of the fibre-optic gyro that has arrived at `now`.
    ///
    /// # Errors
    /// [`ClockError`]: it is not used.
    pub fn add_fog(&mut self, now: Micros, sample: FogSample) -> Result<(), ClockError> {
        let board = self.fog_clock.translate(sample.time, now)?;
        if board.jumped {
            self.fog.disconnect();
        }
        self.begin(board.time);
        self.fog.add(board.time, &sample);
        Ok(())
    }

    /// Returns the next step, if it is complete or due. Call it until `None` after every sample, and at least every
    /// few milliseconds.
    #[inline(never)]
    pub fn next_step(&mut self, now: Micros) -> Option<Step> {
        let next = self.next?;
        let imu = !self.fitted.imu || self.imu.has_reached(Micros(next));
        let fog = !self.fitted.fog || self.fog.has_reached(Micros(next));
        let waited = now.0.saturating_sub(next);
        if waited > MAX_SILENCE_US {
            // Nobody has asked for a second: these steps are of no use to anyone.
            self.restarts = self.restarts.saturating_add(1);
            self.next = Some(now.0.next_multiple_of(PERIOD_US));
            self.imu.clear();
            self.fog.clear();
            return None;
        }
        if !(imu && fog) && waited < MAX_DELAY_US {
            return None;
        }
        self.next = Some(next + PERIOD_US);
        let time = Micros(next);
        let (imu, fog) = (self.imu.at(time), self.fog.take(time));
        let all = self.events();
        let events = Events {
            imu: all.imu.since(&self.reported.imu),
            fog: all.fog.since(&self.reported.fog),
            increments: all.increments.since(&self.reported.increments),
        };
        self.reported = all;
        Some(Step { time, imu, fog, events })
    }

    /// Returns all events since the start.
    #[must_use]
    pub fn events(&self) -> Events {
        Events { imu: *self.imu_clock(), fog: *self.fog_clock(), increments: *self.increments() }
    }

    /// Returns the events of the inertial sensor's clock.
    #[must_use]
    pub fn imu_clock(&self) -> &ClockCounters {
        self.imu_clock.counters()
    }

    /// Returns the events of the fibre-optic gyro's clock.
    #[must_use]
    pub fn fog_clock(&self) -> &ClockCounters {
        self.fog_clock.counters()
    }

    /// Returns the events of the increments.
    #[must_use]
    pub fn increments(&self) -> &IncrementCounters {
        self.fog.counters()
    }

    /// Returns the number of times that the grid began again.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Begins the grid with the next step after `time`, unless it has begun. The first sample does so by itself; a
    /// caller that expects one begins earlier, and gets empty steps until it comes.
    pub fn begin(&mut self, time: Micros) {
        self.next.get_or_insert(time.0.next_multiple_of(PERIOD_US));
    }
}
