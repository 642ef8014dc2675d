//! The idle task runs diagnosis and checks the weights against their checksum.

use crate::crash;
use crate::diagnosis::Diagnosis;
use crate::imu::{self, BringUp};
use crate::queues::{OBSERVATIONS, Observation};
use crate::regions::{Records, Weights};
use crate::stm32f405::{can, clocks, timer};
use crate::tasks::{self, ATTENTION, IDLE_STEP_MS};
use core::sync::atomic::Ordering;
use cortex_m::peripheral::SCB;
use gyronet::coprocessor::Coprocessor;
use gyronet::model::background::BackgroundCheck;
use gyronet::service::Device;
use gyronet::service::event::{ClockFault, SensorFault};
use gyronet::service::message::{AllCounters, LineCounters};
use rtic::mutex_prelude::*;

/// Interval between checks of a failed clock, ms.
const RETRY_MS: u32 = 1_000;
/// Time from one reading of the state of the courses to the next, unless a tester asks; a course comes once a second.
const COURSE_MS: u32 = 100;
/// Time after which a start has not failed, ms.
const SETTLED_MS: u32 = 60_000;
/// Duration of one pass over the weights, ms.
const CHECK_MS: usize = 10_000;

pub struct Idle {
    device: &'static mut Device<Records, Weights>,
    weights: Option<BackgroundCheck<'static>>,
    diagnosis: Diagnosis,
    bring_up: Option<BringUp>,
    /// Why the MTi gives no samples.
    refusal: Option<SensorFault>,
    /// The reason why the internal oscillator runs, and the time of the last check whether that reason is over, ms.
    clock_fault: Option<ClockFault>,
    retried: u32,
    /// Time at which the state of the courses was read last, ms.
    course_at: u32,
    /// Time of the last step, ms.
    stepped: u32,
}

pub type Stored = (&'static mut Device<Records, Weights>, Option<BackgroundCheck<'static>>);

impl Idle {
    #[inline(never)]
    pub fn new(
        (device, weights): Stored,
        diagnosis: Diagnosis,
        bring_up: Option<BringUp>,
        clock_fault: Option<ClockFault>,
    ) -> Self {
        Self {
            device,
            weights,
            diagnosis,
            bring_up,
            refusal: None,
            clock_fault,
            retried: 0,
            course_at: 0,
            stepped: 0,
        }
    }

    /// Does a bounded piece of work, and tells the coprocessor what it has found.
    #[inline(never)]
    pub fn step(
        &mut self,
        coprocessor: &mut impl Mutex<T = &'static mut Coprocessor>,
        lines: &mut impl Mutex<T = LineCounters>,
    ) {
        ATTENTION.store(false, Ordering::Relaxed);
        self.observe();
        let now = timer::milliseconds();
        let before = core::mem::replace(&mut self.stepped, now);
        if now.wrapping_sub(self.course_at) >= COURSE_MS || self.diagnosis.is_busy() {
            self.course_at = now;
            let course = coprocessor.lock(|coprocessor| coprocessor.course_state());
            self.device.learn_course(&course);
        }
        if let Some(result) = self.bring_up.as_mut().and_then(BringUp::step) {
            self.device.sensor(result);
        }
        let refusal = imu::refusal();
        if core::mem::replace(&mut self.refusal, refusal) != refusal {
            self.device.sensor(refusal.map_or(Ok(()), Err));
        }
        let windows = coprocessor.lock(|coprocessor| coprocessor.pipeline().counters().windows);
        self.diagnosis.step(self.device, || {
            (&mut *coprocessor, lines).lock(|coprocessor, lines| AllCounters::of(coprocessor, lines))
        });
        self.retry_clock(now);
        if self.device.firmware_trial(can::is_acknowledged(), windows, now) {
            tasks::with_silence_announced(SCB::sys_reset);
        }
        if before < SETTLED_MS && now >= SETTLED_MS {
            crash::settled();
        }
        if self.check(now.wrapping_sub(before)) {
            coprocessor.lock(|coprocessor| coprocessor.weights_damaged());
        }
        if self.device.take_mount_moved() {
            coprocessor.lock(|coprocessor| coprocessor.mount_moved());
        }
        if self.diagnosis.is_busy() {
            tasks::wake_idle();
        }
    }

    #[inline(never)]
    fn observe(&mut self) {
        while let Some(seen) = OBSERVATIONS.oldest().first() {
            let Observation { sample, tick, status, quality, faults, wheels, standing, vertical } = seen;
            vertical.iter().for_each(|vertical| self.device.learn_vertical(*vertical));
            self.device.observe(sample.as_ref(), *tick, (*status, *faults), wheels, standing);
            self.device.rated(*quality, standing);
            OBSERVATIONS.drop_oldest(1);
        }
    }

    fn retry_clock(&mut self, now: u32) {
        let Some(fault) = self.clock_fault.filter(|_| now.wrapping_sub(self.retried) >= RETRY_MS) else {
            return;
        };
        self.retried = now;
        if clocks::recovered(fault) {
            SCB::sys_reset();
        }
    }

    /// Checks the piece of the weights in use for some milliseconds, and returns whether they were found to be damaged.
    fn check(&mut self, milliseconds: u32) -> bool {
        let pieces = milliseconds.min(2 * IDLE_STEP_MS) as usize;
        if pieces == 0 {
            return false;
        }
        let check = self.weights.as_mut();
        let pass = check.and_then(|check| check.advance(pieces * (check.len() / CHECK_MS + 1)));
        let damaged = pass.is_some_and(|pass| pass.is_err());
        if damaged {
            self.weights = None;
            self.device.weights_damaged();
        }
        damaged
    }
}
