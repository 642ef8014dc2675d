//! Moves diagnostic frames between the lines and the diagnostic server, which runs in idle. The service line is SLCAN
//! that carries only these frames; at 115200 bit/s it could not carry all messages of the board.
//!
//! A tester waits for a flow control frame after as many frames as a ring can hold, so that none is lost however long
//! idle is preempted. Responses are sent after the waiting rates.

use crate::queues::{FROM_CAN, FROM_SLCAN, Line, RESPONSES, ids, is_request};
use crate::regions::{Records, Weights};
use crate::stm32f405::{can, rng, timer};
use crate::{frames, serial, tasks};
use core::sync::atomic::Ordering;
use cortex_m::peripheral::SCB;
use embedded_can::Frame;
use embedded_io::Write;
use gyronet::can::DataFrame;
use gyronet::can::identifier::{packed, unpacked};
use gyronet::can::slcan::port::Port;
use gyronet::health::count;
use gyronet::service::Device;
use gyronet::service::message::AllCounters;
use gyronet::uds::Server;
use gyronet::units::Micros;

/// Serves one tester at a time, on any line.
pub struct Diagnosis {
    tester: Tester,
    service: serial::Port,
    /// The SLCAN port of the service line; one frame waits at most.
    port: Port<2>,
}

struct Tester {
    server: Server,
    /// Line of the current conversation, or of the last one.
    line: Line,
    /// Line of the session, which no tester on another line may use.
    owner: Line,
}

impl Diagnosis {
    pub fn new(service: serial::Port, bits_per_second: u32) -> Self {
        let tester = Tester { server: Server::new(), line: Line::Can, owner: Line::Can };
        Self { tester, service, port: Port::new(bits_per_second) }
    }

    /// Returns whether [`Self::step`] has something to do now, besides what time brings about.
    #[inline]
    pub fn is_busy(&self) -> bool {
        !FROM_CAN.is_empty()
            || !FROM_SLCAN.is_empty()
            || !self.tester.server.is_idle()
            || self.service.is_busy()
            || self.port.is_sending()
    }

    /// Processes the received frames, answers a request, and sends the frames that are due. The `counters` are read for a
    /// request.
    #[inline(never)]
    pub fn step(&mut self, device: &mut Device<Records, Weights>, counters: impl FnOnce() -> AllCounters) {
        let now = timer::milliseconds();
        let Self { tester, service, port } = self;
        service.advance();
        // Errors need no handling: a line that lost a byte is answered as invalid, or just lacks that byte.
        let _ = port.service(service, |frame| {
            let is_request = is_request(frame.id());
            if is_request {
                tester.receive(Line::Service, &frame, now);
            }
            is_request
        });
        for (line, frames) in [(Line::Can, &FROM_CAN), (Line::Slcan, &FROM_SLCAN)] {
            while let Some(frame) = frames.pop() {
                tester.receive(line, &frame, now);
            }
        }
        let Tester { server, line, .. } = tester;
        let have_left = match line {
            Line::Service => !port.is_sending() && service.is_sent(),
            Line::Can => RESPONSES.is_empty() && can::all_sent(),
            Line::Slcan => RESPONSES.is_empty(),
        };
        if have_left {
            server.frames_left(now);
        }
        let counters = || {
            let mut counters = counters();
            count(&mut counters.lines.service_errors, port.refused());
            counters
        };
        server.poll(device, counters, now, rng::bytes);
        frames::SILENCED.store(server.is_silenced(), Ordering::Relaxed);
        while match line {
            Line::Service => !port.is_sending(),
            Line::Can | Line::Slcan => !RESPONSES.is_full(),
        } && let Some(data) = server.next_frame(now)
        {
            let [.., response] = ids();
            let Some(frame) = unpacked(response).and_then(|id| DataFrame::new(id, &data)) else { continue };
            match line {
                Line::Service => port.enqueue(frame, Micros(1_000 * u64::from(now))),
                Line::Can | Line::Slcan => {
                    let _ = RESPONSES.push((*line, frame));
                    tasks::wake_output();
                }
            }
        }
        if server.restart_is_due() && RESPONSES.is_empty() && !port.is_sending() {
            // The flush is bounded: a response that cannot be sent does not delay the restart.
            let _ = service.flush();
            tasks::with_silence_announced(SCB::sys_reset);
        }
    }
}

impl Tester {
    fn receive(&mut self, line: Line, frame: &DataFrame, now: u32) {
        if self.server.is_idle() {
            self.line = line;
        }
        // A tester on another line has to wait.
        if self.line != line {
            return self.server.refuse(self.owner == line, now);
        }
        if !self.server.has_session() {
            self.owner = line;
        }
        self.server.set_guest(self.owner != line);
        let [_, functional, _] = ids();
        if packed(frame.id()) == functional {
            self.server.receive_functional(frame.data(), now);
        } else {
            self.server.receive(frame.data(), now);
        }
    }
}
