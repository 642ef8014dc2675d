//! A fibre-optic gyro from its samples to what goes out, every 10 ms.
//!
//! Its increments come onto the grid of the time that the caller gives ([`Streams`]); inertial sensor
//! and wheels are what the caller knows last, within a step or two, which is nothing to their
//! means over a second. FoGNet runs beside that, as GyroNet does: [`FogLane::window`] is what is
//! due, whoever has time runs it, [`FogLane::deliver`] takes the estimate.
//!
//! | state | rate | source | quality | faults |
//! |---|---|---|---|---|
//! | an estimate is in use | less the correction | FoGNet | good | |
//! | none yet, late, not believed, no weights, no wheels | as it is | raw | degraded | LATE, IMPLAUSIBLE, STORED, WHEELS |
//! | increments are missing in the step, or none have come yet ([`FogLane::expect`]) | not available | raw | unusable | GAP |
//! | five turns in a row are equal ([`STUCK_AFTER`]), until one differs | not available | raw | unusable | STUCK |

use super::{FogConfig, FogCorrector, FogOutput, IncrementRate};
use crate::align::streams::{Fitted, Streams};
use crate::health::{Faults, Quality, Source, count};
use crate::model::fognet::FogEstimate;
use crate::sample::{FogSample, PERIOD_US, WheelSample};
use crate::seconds::{FogFrame, SecondsWindow};
use crate::units::{Angle, Micros, WheelSpeed, Yaw};
use crate::vehicle::YawSample;
use crate::window::Features;
use serde::{Deserialize, Serialize};

/// Turns of 10 ms equal to the one before, after which the gyro is stuck: 50 ms. A DSP-1760's noise in
/// 10 ms is millions of its units; a DSP-3000's a hundred, and repeats a turn once in four hundred, four
/// times in a row once in years.
pub const STUCK_AFTER: u8 = 4;

/// How often each kind of event happened. They saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FogCounters {
    /// Samples taken.
    pub samples: u32,
    /// Samples refused: duplicate or out of order.
    pub misplaced: u32,
    /// Grid steps without a turn: increments are missing, or the gyro is stuck.
    pub gaps: u32,
    /// Times that the gyro was stuck.
    pub stuck: u32,
    /// Windows whose estimate came in time.
    pub windows: u32,
    /// Windows whose estimate did not.
    pub late: u32,
    /// Estimates not believed.
    pub implausible: u32,
    /// Windows that ended before their time: a gap, or too little of the other sensors.
    pub broken: u32,
}

/// A fibre-optic gyro and its corrections.
#[derive(Debug, Clone)]
pub struct FogLane {
    streams: Streams,
    corrector: FogCorrector,
    has_network: bool,
    rate: IncrementRate,
    correction: IncrementRate,
    yaw: Yaw,
    /// The newest turn, and how many before it were the same.
    newest: Angle,
    equal: u8,
    due: Option<u32>,
    /// An estimate is to come with the end of the second.
    awaited: bool,
    /// What was wrong with the newest estimate.
    estimate_faults: Faults,
    counters: FogCounters,
}

impl FogLane {
    /// Nothing received yet. Without a network nothing is due, and the messages say so.
    #[must_use]
    pub fn new(config: FogConfig, has_network: bool) -> Self {
        Self {
            streams: Streams::new(Fitted { imu: false, fog: true }),
            corrector: FogCorrector::new(config),
            has_network,
            rate: IncrementRate::default(),
            correction: IncrementRate::default(),
            yaw: Yaw::default(),
            newest: Angle::ZERO,
            equal: 0,
            due: None,
            awaited: false,
            estimate_faults: Faults::NONE,
            counters: FogCounters::default(),
        }
    }

    /// There is a gyro, whether it is heard or not: messages go out from `now` on, and its silence is told.
    pub fn expect(&mut self, now: Micros) {
        self.streams.begin(now);
    }

    /// Takes a sample that has arrived at `now`. Call [`FogLane::next_step`] until `None` after it.
    pub fn push(&mut self, now: Micros, sample: FogSample) {
        match self.streams.push_fog(now, sample) {
            Ok(()) => count(&mut self.counters.samples, 1),
            Err(_) => count(&mut self.counters.misplaced, 1),
        }
    }

    /// What goes out for the next 10 ms, if they are complete or due; nothing before the first
    /// sample of a gyro that is not expected. To be called every few milliseconds, too, for silence is told here.
    #[inline(never)]
    pub fn next_step(
        &mut self,
        now: Micros,
        inertial: Option<Features>,
        wheels: Option<&WheelSample>,
    ) -> Option<YawSample> {
        let step = self.streams.next_step(now)?;
        let [.., turn] = step.fog.angle;
        let turn = turn.filter(|_| u64::from(step.fog.covered) == PERIOD_US);
        let stuck = self.stands_still(turn);
        let turn = turn.filter(|_| !stuck);
        let wheels = wheels.and_then(rear);
        let output = self.corrector.process(&FogFrame { turn, inertial, wheels });
        self.note(&output);
        let latency_us = u32::try_from(now.0.saturating_sub(step.time.0)).ok();
        let faults = self.estimate_faults;
        let faults = match turn {
            Some(_) => faults,
            None => faults.with(if stuck { Faults::STUCK } else { Faults::GAP }),
        };
        let faults = if wheels.is_none() { faults.with(Faults::WHEELS) } else { faults };
        let faults = if self.has_network { faults } else { faults.with(Faults::STORED) };
        let Some(turn) = output.turn else {
            let (yaw, quality) = (self.yaw, Quality::Unusable);
            return Some(YawSample { yaw, quality, faults, latency_us, ..YawSample::default() });
        };
        let (rate, correction) = (self.rate.rate(turn), self.correction.rate(output.correction));
        self.yaw.0 = self.yaw.0.wrapping_add(i64::from(rate.0));
        let (source, quality) = match output.corrected {
            true => (Source::FogNet, Quality::Good),
            false => (Source::Raw, Quality::Degraded),
        };
        Some(YawSample { rate, correction, yaw: self.yaw, sigma: None, source, quality, faults, latency_us })
    }

    /// Whether the gyro says the same again and again.
    fn stands_still(&mut self, turn: Option<Angle>) -> bool {
        let Some(turn) = turn else {
            self.equal = 0;
            return false;
        };
        let repeated = core::mem::replace(&mut self.newest, turn) == turn;
        self.equal = if repeated { self.equal.saturating_add(1) } else { 0 };
        count(&mut self.counters.stuck, u32::from(self.equal == STUCK_AFTER));
        self.equal >= STUCK_AFTER
    }

    /// The window that is due and its number, once.
    pub fn window(&mut self) -> Option<(u32, SecondsWindow<'_>)> {
        let number = self.due.take()?;
        Some((number, self.corrector.window()?))
    }

    /// Takes the estimate of a window.
    pub fn deliver(&mut self, number: u32, estimate: FogEstimate) {
        self.corrector.deliver(number, estimate);
    }

    /// Event counters since start.
    #[must_use]
    pub fn counters(&self) -> &FogCounters {
        &self.counters
    }

    fn note(&mut self, output: &FogOutput) {
        let FogOutput { corrected, due, broken, implausible, late, .. } = output;
        if let Some(number) = due.filter(|_| self.has_network) {
            let used = self.awaited && !*late && implausible.is_none();
            count(&mut self.counters.windows, u32::from(used));
            self.due = Some(number);
            self.awaited = true;
        }
        count(&mut self.counters.gaps, u32::from(output.turn.is_none()));
        count(&mut self.counters.broken, u32::from(broken.is_some()));
        // A window ends with its second; its estimate is judged with the end of the next one.
        if implausible.is_some() {
            count(&mut self.counters.implausible, 1);
            self.estimate_faults = Faults::IMPLAUSIBLE;
        } else if *late && self.has_network {
            count(&mut self.counters.late, 1);
            self.estimate_faults = Faults::LATE;
        } else if *corrected {
            self.estimate_faults = Faults::NONE;
        }
        if broken.is_some() {
            self.due = None;
            self.awaited = false;
            self.estimate_faults = Faults::NONE;
        }
    }
}

/// Left and right wheel of the rear axle, which is not steered; of the front one where it has none.
fn rear(wheels: &WheelSample) -> Option<[WheelSpeed; 2]> {
    let [front_left, front_right, rear_left, rear_right] = wheels.speeds;
    Some([rear_left.or(front_left)?, rear_right.or(front_right)?])
}
