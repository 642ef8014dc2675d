//! Frames of testers, from the lines to the diagnostic server in idle and back.
//!
//! A tester waits for a flow control after as many frames as a ring has places, so that none is lost however long idle
//! is kept from its turn. Responses leave after the rates that wait.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::pause;
use crate::regions::{Records, Slots};
use crate::ring::Ring;
use crate::stm32f405::timer;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m::peripheral::SCB;
use embedded_can::{ExtendedId, Frame, Id, StandardId};
use gyronet::can::DataFrame;
use gyronet::service::Device;
use gyronet::service::message::AllCounters;
use gyronet::uds::Server;

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

/// The identifiers of requests to this board, requests to all, and frames of this board, as [`pack`] makes them. Set
/// before any task runs.
static IDS: [AtomicU32; 3] = [const { AtomicU32::new(u32::MAX) }; 3];

/// Sets the identifiers.
pub fn set_ids(ids: [Id; 3]) {
    IDS.iter().zip(ids).for_each(|(place, id)| place.store(pack(id), Ordering::Relaxed));
}

/// Returns whether a frame is a request.
pub fn is_request(id: Id) -> bool {
    let [request, functional, _] = ids();
    [request, functional].contains(&pack(id))
}

fn ids() -> [u32; 3] {
    let [request, functional, response] = &IDS;
    [request, functional, response].map(|id| id.load(Ordering::Relaxed))
}

/// The mark of 29 bits.
const EXTENDED: u32 = 1 << 31;

fn pack(id: Id) -> u32 {
    match id {
        Id::Standard(id) => u32::from(id.as_raw()),
        Id::Extended(id) => id.as_raw() | EXTENDED,
    }
}

fn unpack(packed: u32) -> Option<Id> {
    match packed & EXTENDED {
        0 => StandardId::new(packed as u16).map(Id::Standard),
        _ => ExtendedId::new(packed & !EXTENDED).map(Id::Extended),
    }
}

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
                // A tester on the other line has to wait.
                if self.line == line {
                    self.receive(&frame, now);
                } else {
                    self.server.refuse();
                }
            }
        }
        self.server.turn(device, counters, now);
        SILENCED.store(self.server.is_silenced(), Ordering::Relaxed);
        while !RESPONSES.is_full()
            && let Some(data) = self.server.next_frame(now)
        {
            let [.., response] = ids();
            let frame = unpack(response).and_then(|id| DataFrame::new(id, &data));
            frame.into_iter().for_each(|frame| _ = RESPONSES.push((self.line, frame)));
        }
        if self.server.restart_is_due() && RESPONSES.is_empty() {
            pause::announced(SCB::sys_reset);
        }
    }

    fn receive(&mut self, frame: &DataFrame, now: u32) {
        let [_, functional, _] = ids();
        if pack(frame.id()) == functional {
            self.server.receive_functional(frame.data(), now);
        } else {
            self.server.receive(frame.data(), now);
        }
    }
}
