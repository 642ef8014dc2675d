//! The frames of the two lines that carry them: SLCAN if a host has opened it, CAN if its controller works.
//!
//! Frames that CAN receives go from the receive interrupt to the output task, or to idle if they are requests of a
//! tester.

use crate::queues::{FRAMES, FROM_CAN, Line, OBSERVATIONS, Observation, RESPONSES, is_request};
use crate::serial;
use crate::stm32f405::can::{self, Can, Received, STALE_MS, State};
use crate::tasks::{IDLE_STEP_MS, wake_idle};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use embedded_can::Frame as _;
use gyronet::can::DataFrame;
use gyronet::can::queue::TransmitQueue;
use gyronet::can::slcan::host::StatusFlags;
use gyronet::can::slcan::port::Port;
use gyronet::coprocessor::{self, Sink, TimedFrame};
use gyronet::estimate::YawEstimate;
use gyronet::health::count;
use gyronet::units::Micros;

const QUEUE: usize = 24;

/// Number of frames that found no room, in the controller or here. Only the handler counts.
static LOST: AtomicU32 = AtomicU32::new(0);

/// True while frames wait for the controller, so that the output task is to run when one has left.
static WAIT_FOR_CAN: AtomicBool = AtomicBool::new(false);

pub fn do_wait_for_can() -> bool {
    WAIT_FOR_CAN.load(Ordering::Relaxed)
}

/// Handles the receive interrupt: takes every received frame.
pub fn take() {
    while let Some(Received { frame, lost }) = can::receive() {
        let full = frame.is_some_and(|frame| !push(frame));
        let lost = LOST.load(Ordering::Relaxed).saturating_add(u32::from(lost) + u32::from(full));
        LOST.store(lost, Ordering::Relaxed);
    }
}

/// Queues a frame for its task. Returns whether there was room.
fn push(frame: DataFrame) -> bool {
    if is_request(frame.id()) {
        wake_idle();
        FROM_CAN.push(frame)
    } else {
        FRAMES.push(frame)
    }
}

/// Returns the number of frames lost since the start. The controller does not count how many it loses at once, so
/// those count as one.
pub fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}

/// True while a tester has stopped the messages of the board.
pub static SILENCED: AtomicBool = AtomicBool::new(false);

/// Both lines and the frames that wait for them; a [`Sink`] of the coprocessor's frames.
pub struct Outgoing {
    slcan: serial::Port,
    port: Port<QUEUE>,
    can: Option<Can>,
    /// Frames for CAN, each with the time at which it was made, ms.
    queue: TransmitQueue<(DataFrame, u32), QUEUE>,
    /// Board time, ms.
    now: u32,
    /// Observations that idle missed for lack of time.
    overruns: u32,
    /// Time at which idle got work last, ms.
    attended: u32,
    /// True while the oldest response is on its way on SLCAN.
    responds: bool,
}

impl Outgoing {
    pub fn new(slcan: serial::Port, bits_per_second: u32, can: Option<Can>) -> Self {
        let (port, queue) = (Port::new(bits_per_second), TransmitQueue::new());
        Self { slcan, port, can, queue, now: 0, overruns: 0, attended: 0, responds: false }
    }

    pub fn join(&self) {
        self.can.iter().for_each(Can::join);
    }

    /// Returns whether SLCAN has something to send, or a host has sent something.
    pub fn is_slcan_busy(&self) -> bool {
        self.slcan.is_busy() || self.port.is_sending() || self.responds || !RESPONSES.is_empty()
    }

    /// Sends as much as SLCAN accepts; passes the frames that a host has sent over it to `take`, which returns whether a
    /// frame is used.
    pub fn service(&mut self, take: impl FnMut(DataFrame) -> bool) {
        self.port.set_bus(match self.state() {
            State::Active => StatusFlags::default(),
            State::Warning => StatusFlags::ERROR_WARNING,
            State::Passive => StatusFlags::ERROR_PASSIVE,
            State::Off => StatusFlags::BUS_ERROR,
        });
        self.slcan.advance();
        // One response at a time, after the rates have been sent. It stays in the ring until it has left.
        if self.responds && !self.port.is_sending() && self.slcan.is_sent() {
            self.responds = false;
            RESPONSES.drop_oldest(1);
        }
        if let Some((Line::Slcan, frame)) = RESPONSES.oldest().first()
            && !self.responds
            && !self.port.is_sending()
        {
            self.responds = true;
            self.port.enqueue(*frame, self.stamp());
        }
        // Errors need no handling: a line that lost a byte is answered as invalid, or just lacks that byte.
        let _ = self.port.service(&mut self.slcan, take);
    }

    /// Returns whether no frame waits for CAN or is being sent.
    pub fn is_sent(&self) -> bool {
        self.queue.is_empty() && can::all_sent()
    }

    /// Returns whether no line needs attention before something comes or a frame has left.
    pub fn is_at_rest(&self) -> bool {
        self.can.as_ref().is_none_or(Can::is_on) && !self.is_slcan_busy()
    }

    /// Sets the time, ms, and polls the controller. Called every millisecond while a line needs attention.
    pub fn tick(&mut self, now: u32) {
        self.now = now;
        self.can.iter_mut().for_each(|can| can.poll(now));
    }

    fn attend(&mut self) {
        self.attended = self.now;
        wake_idle();
    }

    pub fn attend_if_due(&mut self) {
        if self.now.wrapping_sub(self.attended) >= IDLE_STEP_MS {
            self.attend();
        }
    }

    /// Passes frames to the controller while it has room. Stale frames are dropped; in bus-off, all of them.
    pub fn refill(&mut self) {
        let Some(can) = self.can.as_mut() else { return };
        if self.queue.is_empty() && RESPONSES.is_empty() {
            return WAIT_FOR_CAN.store(false, Ordering::Relaxed);
        }
        let off = can.state() == State::Off;
        while let Some((frame, made)) = self.queue.front() {
            if off || self.now.wrapping_sub(*made) > STALE_MS {
                self.queue.drop_front();
            } else if can.transmit(frame, *made) {
                let _ = self.queue.pop();
            } else {
                break;
            }
        }
        while let Some((Line::Can, frame)) = RESPONSES.oldest().first() {
            // In bus-off the response is dropped, since the tester could not receive it.
            if !off && (!self.queue.is_empty() || !can.transmit(frame, self.now)) {
                break;
            }
            RESPONSES.drop_oldest(1);
        }
        WAIT_FOR_CAN.store(!self.queue.is_empty() || !RESPONSES.is_empty(), Ordering::Relaxed);
    }

    /// Returns the time stamp of what is sent now, whoever sends it: board time.
    fn stamp(&self) -> Micros {
        Micros(1_000 * u64::from(self.now))
    }

    /// Returns the number of text lines of a host that were refused.
    pub fn refused(&self) -> u32 {
        self.port.refused()
    }

    /// Returns the number of frames that a line did not accept in time.
    pub fn dropped(&self) -> u32 {
        self.port.dropped().saturating_add(self.queue.dropped()).saturating_add(can::aborted())
    }

    pub const fn overruns(&self) -> u32 {
        self.overruns
    }

    pub fn state(&self) -> State {
        self.can.as_ref().map_or(State::Active, Can::state)
    }

    /// Returns the number of bytes of the SLCAN line that were damaged or lost.
    pub fn lost(&self) -> u32 {
        self.slcan.lost()
    }
}

impl Sink for Outgoing {
    #[inline(never)]
    fn observed(&mut self, observation: &coprocessor::Observation) {
        let coprocessor::Observation { sample, vehicle, wheels, standing, vertical, .. } = observation;
        let YawEstimate { status, quality, faults, .. } = vehicle.live;
        let has_room = OBSERVATIONS.push_with(|| {
            let (sample, wheels, standing, vertical) = (*sample, *wheels, *standing, *vertical);
            let tick = vehicle.tick;
            Observation { sample, tick, status, quality, faults, wheels, standing, vertical }
        });
        count(&mut self.overruns, u32::from(!has_room));
        self.attend();
    }

    /// Queues a frame for CAN, and for SLCAN if its host has opened it, unless a tester has silenced the board.
    #[inline(never)]
    fn frame(&mut self, TimedFrame { frame, .. }: TimedFrame) {
        if SILENCED.load(Ordering::Relaxed) {
            return;
        }
        if self.port.is_open() {
            self.port.enqueue(frame, self.stamp());
        }
        if self.can.is_some() {
            self.queue.enqueue((frame, self.now));
        }
    }
}
