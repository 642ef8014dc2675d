//! What is done when nothing else is to do: the service line, and the weights' own checksum.

use crate::fog_network::FogNetwork;
use crate::imu::BringUp;
use crate::queue::Queue;
use crate::regions::{Records, Slots};
use crate::{board, clock, serial};
use embedded_io::{Write, WriteReady};
use gyronet::health::Status;
use gyronet::model::FogNet;
use gyronet::model::background::BackgroundCheck;
use gyronet::sample::ImuSample;
use gyronet::service::Device;
use gyronet::service::frame::Frame;
use gyronet::service::message::AllCounters;

/// Bytes of the service line that are looked at in one turn.
const SERVICE_TURN: usize = 16;
/// How long one pass over the weights takes.
const CHECK_MS: usize = 10_000;

/// What the output task tells of a sample.
pub struct Observation {
    /// `None`: the sensor is silent.
    pub sample: Option<ImuSample>,
    pub tick: u32,
    pub status: Status,
}

/// Samples that idle has not looked at.
pub static OBSERVATIONS: Queue<Observation, 8> = Queue::new();

/// The idle task.
pub struct Idle {
    device: &'static mut Device<Records, Slots>,
    check: Option<BackgroundCheck<'static>>,
    service: serial::Port<{ board::SERVICE_QUEUE }>,
    fog_network: FogNetwork,
    bring_up: Option<BringUp>,
    /// An answer on its way out, and how much of it is.
    answer: Frame,
    sent: usize,
    milliseconds: u32,
}

/// What is stored, and the weights to be looked after.
pub type Stored = (&'static mut Device<Records, Slots>, Option<BackgroundCheck<'static>>);

impl Idle {
    #[inline(never)]
    pub fn new(
        (device, check): Stored,
        service: serial::Port<{ board::SERVICE_QUEUE }>,
        fog_network: Option<&'static mut FogNet<'static, 'static>>,
        bring_up: Option<BringUp>,
    ) -> Self {
        let fog_network = FogNetwork::new(fog_network);
        Self { device, check, service, fog_network, bring_up, answer: Frame::new(), sent: 0, milliseconds: 0 }
    }

    /// A bounded piece of work; whether the weights were found to be damaged.
    #[inline(never)]
    pub fn turn(&mut self, counters: &AllCounters) -> bool {
        while let Some(Observation { sample, tick, status }) = OBSERVATIONS.pop() {
            self.device.observe(sample.as_ref(), tick, status);
        }
        if let Some(result) = self.bring_up.as_mut().and_then(BringUp::turn) {
            self.device.sensor(result);
        }
        self.answer(counters);
        self.check()
    }

    /// FoGNet, for what it shares with the output task.
    pub fn fog_network(&mut self) -> &mut FogNetwork {
        &mut self.fog_network
    }

    fn check(&mut self) -> bool {
        let now = clock::milliseconds();
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
        if !self.answer.is_empty() {
            while let Some(rest) = self.answer.get(self.sent..).filter(|rest| !rest.is_empty()) {
                let Ok(true) = self.service.write_ready() else { return };
                let Ok(len) = self.service.write(rest) else { return };
                self.sent += len;
            }
            self.answer.clear();
            self.sent = 0;
            if self.device.restart_wanted() {
                // Bounded; an answer that does not get out keeps nobody from starting anew.
                let _ = self.service.flush();
                cortex_m::peripheral::SCB::sys_reset();
            }
        }
        for _ in 0..SERVICE_TURN {
            let Some(byte) = self.service.receive() else { return };
            if let Some(answer) = self.device.push(byte, counters) {
                self.answer = answer;
                return;
            }
        }
    }
}
