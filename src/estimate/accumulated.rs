//! The accumulated yaw: the sum of the rates that may be used, the gaps in it, and how much may be missing.
//!
//! The angle turned while no rate may be used is missing for good. With the rates v and w before and after a gap
//! of T seconds, a random walk between them, it is likely (v + w) T / 2, with a variance of ((v - w) T / 2)^2 + q^2
//! T^3 / 3. The likely angles of many gaps in one turn add up; their rest does not.

use super::YawEstimate;
use crate::health::Quality;
use crate::sample::RATE_HZ;
use crate::units::{AngularRate, Yaw};

/// Random walk q of a vehicle's yaw rate, rad/s per square root of a second.
const WALK: f32 = 0.2;

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AccumulatedYaw {
    pub(crate) yaw: Yaw,
    gaps: u32,
    /// Tick and rate of the newest step in the yaw.
    newest: Option<(u32, AngularRate)>,
    /// The tick after which the next gap ends, and the steps by which it is longer than the ticks show.
    hidden: Option<(u32, u32)>,
}

impl AccumulatedYaw {
    pub(crate) const START: Self = Self { yaw: Yaw(0), gaps: 0, newest: None, hidden: None };

    /// Adds the angle `turned` in a step, a code of [`Yaw`], unless its estimate may not be used; sets the estimate's
    /// yaw. Returns the angle that a gap before this step has left out.
    pub(crate) fn add(&mut self, estimate: &mut YawEstimate, turned: i64) -> Missed {
        let mut missed = Missed::NOTHING;
        if matches!(estimate.quality, Quality::Good | Quality::Degraded) {
            self.yaw.0 = self.yaw.0.wrapping_add(turned);
            let YawEstimate { tick, rate, .. } = *estimate;
            if let Some((last, before)) = self.newest.replace((tick, rate)) {
                let hidden = self.hidden.take_if(|(after, _)| is_later(tick, *after));
                let between = tick.wrapping_sub(last).saturating_sub(1);
                let steps = between.saturating_add(hidden.map_or(0, |(_, steps)| steps));
                self.gaps = self.gaps.saturating_add(u32::from(steps > 0));
                missed = Missed::between(steps, before, rate);
            }
        }
        estimate.yaw = self.yaw;
        missed
    }

    /// Lengthens the gap that ends with the first usable rate after a tick, by steps of which the ticks know nothing.
    pub(crate) fn lose(&mut self, after: u32, steps: u32) {
        let before = self.hidden.map_or(0, |(_, steps)| steps);
        self.hidden = Some((after, before.saturating_add(steps)));
    }

    /// The number of gaps; `None` before the yaw begins.
    pub(crate) fn gaps(&self) -> Option<u32> {
        self.newest.map(|_| self.gaps)
    }

    /// The angle that is missing in a gap that has lasted until `tick`.
    pub(crate) fn missing(&self, tick: u32) -> Missed {
        let Some((last, before)) = self.newest else { return Missed::NOTHING };
        let steps = if is_later(tick, last) { tick.wrapping_sub(last) } else { 0 };
        let hidden = self.hidden.map_or(0, |(_, steps)| steps);
        Missed::between(steps.saturating_add(hidden), before, before)
    }
}

fn is_later(tick: u32, than: u32) -> bool {
    tick.wrapping_sub(than) as i32 > 0
}

/// An angle that a gap has left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// The likely angle, rad.
    pub angle: f32,
    /// Its variance, rad^2.
    pub variance: f32,
}

impl Missed {
    /// No gap.
    pub const NOTHING: Self = Self { angle: 0.0, variance: 0.0 };

    /// The angle turned in `steps` between two rates.
    fn between(steps: u32, before: AngularRate, after: AngularRate) -> Self {
        let seconds = steps as f32 / RATE_HZ as f32;
        let [before, after] =
            [before, after].map(|rate| rate.0 as f32 / AngularRate::PER_RAD_PER_SEC * seconds);
        let half = (after - before) / 2.0;
        let walked = WALK * WALK / 3.0 * seconds * seconds * seconds;
        Self { angle: (before + after) / 2.0, variance: half * half + walked }
    }
}
