//! The idle task runs the service line and diagnosis and checks the weights against their checksum.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::diagnosis::Diagnosis;
use crate::fog_network::{FogNetwork, FogParts};
use crate::imu::BringUp;
use crate::regions::{Records, Slots};
use crate::ring::Ring;
use crate::serial;
use crate::stm32f405::{clocks, timer};
use embedded_io::{Write, WriteReady};
use gyronet::health::{Faults, Status};
use gyronet::model::background::BackgroundCheck;
use gyronet::sample::{ImuSample, Standstill};
use gyronet::service::Device;
use gyronet::service::event::ClockFault;
use gyronet::service::frame::Frame;
use gyronet::service::message::AllCounters;

/// Bytes of the service line that are looked at in one turn.
const SERVICE_TURN: usize = 16;
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
    pub wheels: Standstill,
}

/// Samples that idle has not looked at.
pub static OBSERVATIONS: Ring<Observation, 8> =
    // SAFETY: the output task writes, idle reads.
    unsafe { Ring::new() };

/// Holds the state of the idle task.
pub struct Idle {
    device: &'static mut Device<Records, Slots>,
    check: Option<BackgroundCheck<'static>>,
    service: serial::Port,
    diagnosis: Diagnosis,
    fog_network: FogNetwork,
    bring_up: Option<BringUp>,
    /// The reason why the internal oscillator runs, and the time of the last look whether that is over, ms.
    clock_fault: Option<ClockFault>,
    retried: u32,
    /// An answer on its way out, and how much of it is.
    answer: Frame,
    sent: usize,
    milliseconds: u32,
}

/// The stored data, and the check of the weights in use.
pub type Stored = (&'static mut Device<Records, Slots>, Option<BackgroundCheck<'static>>);

impl Idle {
    #[inline(never)]
    pub fn new(
        (device, check): Stored,
        service: serial::Port,
        fog_network: Option<&'static mut FogParts>,
        bring_up: Option<BringUp>,
        clock_fault: Option<ClockFault>,
    ) -> Self {
        let fog_network = FogNetwork::new(fog_network);
        Self {
            device,
            check,
            service,
            diagnosis: Diagnosis::new(),
            fog_network,
            bring_up,
            clock_fault,
            retried: 0,
            answer: Frame::new(),
            sent: 0,
            milliseconds: 0,
        }
    }

    /// Does a bounded piece of work, and returns whether the weights were found to be damaged.
    #[inline(never)]
    pub fn turn(&mut self, counters: &AllCounters) -> bool {
        while let Some(Observation { sample, tick, status, faults, wheels }) = OBSERVATIONS.pop() {
            self.device.observe(sample.as_ref(), tick, (status, faults), wheels);
        }
        if let Some(result) = self.bring_up.as_mut().and_then(BringUp::turn) {
            self.device.sensor(result);
        }
        self.answer(counters);
        self.diagnosis.turn(self.device, counters);
        self.retry_clock();
        self.check()
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

    fn check(&mut self) -> bool {
        let now = timer::milliseconds();
        let Some(check) = self.check.as_mut().filter(|_| now != self.milliseconds) else { return false };
        self.milliseconds = now;
        let piece = check.len() / CHECK_MS + 1;
        let damaged = check.advance(piece).is_some_and(|pass| pass.is_err());
        if damaged {
            self.device.weights_damaged();
            self.check = None;
        }
        damaged
    }

    /// The service line's turn: the answer on its way, then the next question.
    #[inline(never)]
    fn answer(&mut self, counters: &AllCounters) {
        self.service.advance();
        if !self.answer.is_empty() {
            while let Some(rest) = self.answer.get(self.sent..).filter(|rest| !rest.is_empty()) {
                let Ok(true) = self.service.write_ready() else { return };
                let Ok(len) = self.service.write(rest) else { return };
                self.sent += len;
            }
            self.answer.clear();
            self.sent = 0;
            if self.device.restart_wanted() {
                // Bounded; an answer that does not get out does not hold up the restart.
                let _ = self.service.flush();
                cortex_m::peripheral::SCB::sys_reset();
            }
        }
        for _ in 0..SERVICE_TURN {
            let Some(byte) = self.service.receive() else { return };
            if let Some(answer) = self.device.receive(byte, counters) {
                self.answer = answer;
                return;
            }
        }
    }
}
