//! The idle task runs diagnosis and checks the weights against their checksum.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::diagnosis::Diagnosis;
use crate::fog_network::{FogNetwork, FogParts};
use crate::imu::BringUp;
use crate::regions::{Records, Weights};
use crate::ring::Ring;
use crate::stm32f405::{clocks, timer};
use gyronet::coprocessor::Coprocessor;
use gyronet::health::{Faults, Status};
use gyronet::model::background::BackgroundCheck;
use gyronet::sample::{ImuSample, WheelSample};
use gyronet::service::Device;
use gyronet::service::event::ClockFault;
use gyronet::service::message::AllCounters;

/// Interval at which a failed clock is tried again.
const RETRY_MS: u32 = 1_000;
/// The time that one pass over the weights takes.
const CHECK_MS: usize = 10_000;

/// Reports a sample from the output task to idle.
pub struct Observation {
    /// `None`: the sensor is silent.
    pub sample: Option<ImuSample>,
    pub tick: u32,
    pub status: Status,
    pub faults: Faults,
    pub wheels: WheelSample,
}

/// Samples that idle has not looked at.
pub static OBSERVATIONS: Ring<Observation, 8> =
    // SAFETY: the output task writes, idle reads.
    unsafe { Ring::new() };

/// Faults that the idle task has found, for the coprocessor.
pub struct Found {
    weights_damaged: bool,
    fognet_gone: bool,
    mount_moved: bool,
}

impl Found {
    /// Returns whether there is anything to report.
    pub fn is_something(&self) -> bool {
        self.weights_damaged || self.fognet_gone || self.mount_moved
    }

    /// Reports it.
    pub fn report(&self, coprocessor: &mut Coprocessor) {
        if self.weights_damaged {
            coprocessor.weights_damaged();
        }
        if self.fognet_gone {
            coprocessor.fognet_gone();
        }
        if self.mount_moved {
            coprocessor.mount_moved();
        }
    }
}

/// Holds the state of the idle task.
pub struct Idle {
    device: &'static mut Device<Records, Weights>,
    checks: Checks,
    diagnosis: Diagnosis,
    fog_network: FogNetwork,
    bring_up: Option<BringUp>,
    /// The reason why the internal oscillator runs, and the time of the last look whether that is over, ms.
    clock_fault: Option<ClockFault>,
    retried: u32,
    milliseconds: u32,
}

/// The checks of the weights in use.
pub struct Checks {
    pub weights: Option<BackgroundCheck<'static>>,
    pub fognet: Option<BackgroundCheck<'static>>,
}

/// The stored data, and the checks.
pub type Stored = (&'static mut Device<Records, Weights>, Checks);

impl Idle {
    #[inline(never)]
    pub fn new(
        (device, checks): Stored,
        diagnosis: Diagnosis,
        fog_network: Option<&'static mut FogParts>,
        bring_up: Option<BringUp>,
        clock_fault: Option<ClockFault>,
    ) -> Self {
        let fog_network = FogNetwork::new(fog_network);
        Self { device, checks, diagnosis, fog_network, bring_up, clock_fault, retried: 0, milliseconds: 0 }
    }

    /// Does a bounded piece of work, and returns what it has found.
    #[inline(never)]
    pub fn turn(&mut self, counters: &mut AllCounters) -> Found {
        self.observe();
        if let Some(result) = self.bring_up.as_mut().and_then(BringUp::turn) {
            self.device.sensor(result);
        }
        counters.lines.service_errors = self.diagnosis.refused();
        self.diagnosis.turn(self.device, counters);
        self.retry_clock();
        let weights_damaged = self.check();
        let fognet_gone = self.device.take_fognet_gone();
        if fognet_gone {
            self.fog_network.stop();
            self.checks.fognet = None;
        }
        Found { weights_damaged, fognet_gone, mount_moved: self.device.take_mount_moved() }
    }

    #[inline(never)]
    fn observe(&mut self) {
        while let Some(Observation { sample, tick, status, faults, wheels }) = OBSERVATIONS.pop() {
            self.device.observe(sample.as_ref(), tick, (status, faults), &wheels);
        }
    }

    /// Returns whether there is more to do before the next interrupt.
    pub fn is_busy(&self) -> bool {
        self.fog_network.is_running()
    }

    /// Restarts the board once the fault that keeps it on the internal oscillator is over.
    fn retry_clock(&mut self) {
        let now = timer::milliseconds();
        let Some(fault) = self.clock_fault.filter(|_| now.wrapping_sub(self.retried) >= RETRY_MS) else {
            return;
        };
        self.retried = now;
        if clocks::recovered(fault) {
            cortex_m::peripheral::SCB::sys_reset();
        }
    }

    /// Returns FoGNet, for the work that it shares with the output task.
    pub fn fog_network(&mut self) -> &mut FogNetwork {
        &mut self.fog_network
    }

    /// Checks a piece of the weights in use, and returns whether GyroNet's were found to be damaged.
    fn check(&mut self) -> bool {
        let now = timer::milliseconds();
        if now == self.milliseconds {
            return false;
        }
        self.milliseconds = now;
        let is_damaged = |check: &mut Option<BackgroundCheck<'static>>| {
            let pass = check.as_mut().and_then(|check| check.advance(check.len() / CHECK_MS + 1));
            let damaged = pass.is_some_and(|pass| pass.is_err());
            if damaged {
                *check = None;
            }
            damaged
        };
        if is_damaged(&mut self.checks.fognet) {
            self.device.fognet_damaged();
        }
        let damaged = is_damaged(&mut self.checks.weights);
        if damaged {
            self.device.weights_damaged();
        }
        damaged
    }
}
