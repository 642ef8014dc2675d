//! The pipeline behind a watch over its sensor: what host and board run.
//!
//! [`Pipeline`] knows samples only. Here is what a sensor does wrong beyond single samples: it
//! says nothing, it says the same again and again, it has just been saturated. Time comes in as
//! an argument, by the board's own clock: the part's stands still with the part.
//!
//! | fault | found when | then | over when |
//! |---|---|---|---|
//! | silent | no sample for [`TIMEOUT_US`], or for [`START_US`] since the start | every 10 ms a message set without a rate, [`Status::Silent`] | the next sample |
//! | stuck | [`STUCK_AFTER`] samples equal to the one before in gyro, accelerometer or one axis; [`AXIS_STUCK_AFTER`] where an axis often repeats itself | [`Status::Stuck`], no window, no initialisation | a sample that differs |
//! | wrong | a reading that is further from the last one than a vehicle goes in 10 ms ([`JUMP_RATE`], [`JUMP_FORCE`]) | as saturated, fault bit `IMPLAUSIBLE` | a reading near the last good one, or [`JUMP_PATIENCE`] samples later |
//! | accumulated yaw changed in memory | its step is neither the rate nor zero | fault bit `IMPLAUSIBLE` | at once |
//! | saturated | the part says so | [`Status::Clipped`], no window, no initialisation | [`HOLD`] samples later |

mod jump;
mod still;

pub use jump::{JUMP_FORCE, JUMP_PATIENCE, JUMP_RATE};
pub use still::{AXIS_STUCK_AFTER, STUCK_AFTER};

use crate::align::AlignError;
use crate::health::{Faults, Quality, Source, Status, WatchCounters, count};
use crate::pipeline::{Output, Pipeline, PipelineConfig};
use crate::sample::{ImuSample, PERIOD_US, WheelSample};
use crate::units::{AngularRate, Micros, SpecificForce, Yaw};
use crate::vehicle::{PromptSample, VehicleSample, YawSample};

/// Without a sample for so long the sensor is silent: two samples missing, and told before the
/// third one would come.
pub const TIMEOUT_US: u64 = 29_000;
/// After a start an MTi needs about a second before it speaks.
pub const START_US: u64 = 2_000_000;
/// Samples after saturation that are not trusted: 50 ms, in which the part's filter recovers.
pub const HOLD: u8 = 5;

/// A pipeline and the watch over its sensor.
#[derive(Debug, Clone)]
pub struct Guard {
    pipeline: Pipeline,
    still: still::Still,
    jump: jump::Jump,
    stuck: bool,
    hold: u8,
    /// When the sensor was heard of, by the board's clock.
    heard: Option<Micros>,
    /// When the next message set without a sample is due.
    due: Option<u64>,
    /// Yaw and step of what went out last.
    newest: (Yaw, u32),
    counters: WatchCounters,
}

impl Guard {
    /// Before the first sample.
    #[must_use]
    pub fn new(config: PipelineConfig) -> Self {
        Self {
            pipeline: Pipeline::new(config),
            still: still::Still::new(),
            jump: jump::Jump::default(),
            stuck: false,
            hold: 0,
            heard: None,
            due: None,
            newest: Default::default(),
            counters: WatchCounters::default(),
        }
    }

    /// The pipeline, for its counters and to deliver estimates.
    pub fn pipeline(&mut self) -> &mut Pipeline {
        &mut self.pipeline
    }

    /// What the watch has counted.
    #[must_use]
    pub fn counters(&self) -> &WatchCounters {
        &self.counters
    }

    /// Hands on what is known of the wheels.
    pub fn wheels(&mut self, wheels: WheelSample) {
        self.pipeline.wheels(wheels);
    }

    /// Takes a sample that was received at `now`.
    ///
    /// # Errors
    /// [`AlignError`] when its time stamp has no place; it is counted and not used.
    pub fn process(&mut self, mut sample: ImuSample, now: Micros) -> Result<Output, AlignError> {
        let stuck = self.still.process(&sample);
        let began = !core::mem::replace(&mut self.stuck, stuck) && stuck;
        count(&mut self.counters.stuck, u32::from(began));
        let saturated = sample.clipped;
        self.hold = if saturated { HOLD + 1 } else { self.hold.saturating_sub(1) };
        count(&mut self.counters.held, u32::from(!saturated && self.hold > 0));
        let clipped = saturated || self.hold > 0;
        // What is beyond the range is no reading to hold others against.
        let wrong = !clipped && self.jump.process(&sample);
        count(&mut self.counters.wrong, u32::from(wrong));
        sample.clipped = clipped || stuck || wrong;
        // Worked on where it is returned: it is too large to be copied about on a small stack.
        let mut result = self.pipeline.process(sample);
        let Ok(output) = &mut result else { return result };
        self.heard = Some(now);
        self.due = None;
        let told = match (stuck, wrong) {
            (true, _) => Some(Faults::STUCK),
            (false, true) => Some(Faults::IMPLAUSIBLE),
            (false, false) => None,
        };
        if let Some(told) = told {
            let faults = &mut output.vehicle.yaw.faults;
            *faults = faults.without(if saturated { Faults::NONE } else { Faults::CLIPPED }).with(told);
        }
        if stuck {
            output.prompt.status = Status::Stuck;
        }
        // The accumulated yaw goes on by the rate that goes out with it, or not at all: else a bit of it
        // has flipped in memory.
        let YawSample { yaw, rate, faults, .. } = &mut output.vehicle.yaw;
        let turned = yaw.0.wrapping_sub(self.newest.0.0);
        if turned != 0 && turned != i64::from(rate.0) {
            count(&mut self.counters.wrong, 1);
            *faults = faults.with(Faults::IMPLAUSIBLE);
        }
        self.newest = (output.vehicle.yaw.yaw, output.vehicle.tick);
        result
    }

    /// Samples wait and could not be looked at: the sensor is not silent.
    pub fn wait(&mut self, now: Micros) {
        self.heard = self.heard.and(Some(now));
    }

    /// What is to be sent without a sample, when that is due. Call it every millisecond or so.
    pub fn poll(&mut self, now: Micros) -> Option<VehicleSample> {
        let due = match (self.due, self.heard) {
            (Some(due), _) => due,
            (None, Some(heard)) => heard.0 + TIMEOUT_US,
            (None, None) => START_US,
        };
        if now.0 < due {
            return None;
        }
        let first = self.due.is_none();
        count(&mut self.counters.silences, u32::from(first));
        // Without catching up: a set that nobody had time for is of no use later.
        self.due = Some(now.0.max(due) + PERIOD_US);
        let missing = if first { TIMEOUT_US.div_ceil(PERIOD_US) as u32 } else { 1 };
        let (yaw, tick) = &mut self.newest;
        *tick = tick.wrapping_add(missing);
        Some(silent(*yaw, *tick))
    }
}

/// No rate, no force, and the yaw that was known.
fn silent(yaw: Yaw, tick: u32) -> VehicleSample {
    VehicleSample {
        prompt: PromptSample { rate: AngularRate::ZERO, quality: Quality::Unusable },
        yaw: YawSample {
            yaw,
            source: Source::Raw,
            quality: Quality::Unusable,
            faults: Faults::GAP,
            ..YawSample::default()
        },
        roll_rate: AngularRate::ZERO,
        pitch_rate: AngularRate::ZERO,
        specific_force: [SpecificForce(0); 3],
        temperature: None,
        tick,
    }
}
