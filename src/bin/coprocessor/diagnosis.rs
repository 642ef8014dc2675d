//! Frames of testers, from the lines to the diagnostic server in idle and back.
//!
//! A tester waits for a flow control after as many frames as a ring has places, so that none is lost however long idle
//! is kept from its turn. Responses leave after the rates that wait.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::pause;
use crate::regions::{Records, Slots};
use crate::ring::Ring;
use crate::stm32f405::timer;
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::peripheral::SCB;
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::service::Device;
use gyronet::service::message::AllCounters;
use gyronet::uds::{Server, Target, response_id, target};

/// A line that testers use.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Line {
    Can,
    Slcan,
}

/// Requests on CAN.
pub static FROM_CAN: Ring<DataFrame, 16> =
    // SAFETY: the receive interrupt writes, idle reads.
    unsafe { Ring::new() };
/// Requests on SLCAN.
pub static FROM_SLCAN: Ring<DataFrame, 16> =
    // SAFETY: the output task writes, idle reads.
    unsafe { Ring::new() };
/// Responses.
pub static RESPONSES: Ring<(Line, DataFrame), 16> =
    // SAFETY: idle writes, the output task reads.
    unsafe { Ring::new() };

/// A tester has stopped the messages of the board.
static SILENCED: AtomicBool = AtomicBool::new(false);

/// Returns whether a tester has stopped the messages of the board.
pub fn is_silenced() -> bool {
    SILENCED.load(Ordering::Relaxed)
}

/// Serves one tester at a time, on either line.
pub struct Diagnosis {
    server: Server,
    /// The line of the conversation under way, or of the last one.
    line: Line,
}

impl Diagnosis {
    pub const fn new() -> Self {
        Self { server: Server::new(), line: Line::Can }
    }

    /// Takes the frames that have come, answers a request, and sends the frames that are due.
    #[inline(never)]
    pub fn turn(&mut self, device: &mut Device<Records, Slots>, counters: &AllCounters) {
        let now = timer::milliseconds();
        for (line, frames) in [(Line::Can, &FROM_CAN), (Line::Slcan, &FROM_SLCAN)] {
            while let Some(frame) = frames.pop() {
                if self.server.is_idle() {
                    self.line = line;
                }
                // A tester on the other line has to wait until the bus is free for it.
                if self.line == line {
                    self.receive(&frame, now);
                }
            }
        }
        self.server.turn(device, counters, now);
        SILENCED.store(self.server.is_silenced(), Ordering::Relaxed);
        while !RESPONSES.is_full()
            && let Some(data) = self.server.next_frame(now)
        {
            let frame = DataFrame::new(Id::Standard(response_id()), &data);
            frame.into_iter().for_each(|frame| _ = RESPONSES.push((self.line, frame)));
        }
        if device.restart_wanted() && self.server.is_idle() && RESPONSES.is_empty() {
            pause::announced(SCB::sys_reset);
        }
    }

    fn receive(&mut self, frame: &DataFrame, now: u32) {
        match target(frame.id()) {
            Some(Target::Server) => self.server.receive(frame.data(), now),
            Some(Target::All) => self.server.receive_functional(frame.data(), now),
            None => {}
        }
    }
}
