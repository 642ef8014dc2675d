//! The device side of an SLCAN line: it sends frames and executes commands.
//!
//! [`Port::service`] moves the buffered bytes to and from any serial line that says whether it is ready, without
//! blocking. When the queue is full the oldest frame is dropped. A line of text that was begun is finished first, so a
//! host that stalls never reads a partial frame.

use super::assembler::{LineAssembler, TooLong};
use super::host::{Session, StatusFlags};
use super::{MAX_STAMPED_LINE, encode};
use crate::can::DataFrame;
use crate::can::queue::TransmitQueue;
use crate::health::count;
use crate::units::Micros;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use heapless::Vec;

/// Capacity of the buffer for waiting answers, bytes: enough for the start-up commands of several hosts.
const MAX_ANSWERS: usize = 64;
/// Most bytes read from the host in one call, so that a flood of input cannot delay the output.
const MAX_RECEIVED: usize = 64;

const _: () = assert!(
    MAX_ANSWERS > MAX_STAMPED_LINE,
    "an answer also has room for a line, since both are sent the same way"
);

/// The device side of an SLCAN line, with a queue of at most `N` frames.
#[derive(Debug, Clone)]
pub struct Port<const N: usize> {
    session: Session,
    assembler: LineAssembler,
    queue: TransmitQueue<(DataFrame, Micros), N>,
    answers: Vec<u8, MAX_ANSWERS>,
    unanswered: u32,
    /// The text line or answers being sent; `taken` bytes of it have been sent.
    line: [u8; MAX_ANSWERS],
    length: usize,
    taken: usize,
    /// Number of dropped frames when `F` was last answered.
    reported: u32,
    bus: StatusFlags,
}

impl<const N: usize> Port<N> {
    /// Creates a port for a bus of this bit rate, with empty buffers.
    pub const fn new(bits_per_second: u32) -> Self {
        Self {
            session: Session::new(bits_per_second),
            assembler: LineAssembler::new(),
            queue: TransmitQueue::new(),
            answers: Vec::new(),
            unanswered: 0,
            line: [0; MAX_ANSWERS],
            length: 0,
            taken: 0,
            reported: 0,
            bus: StatusFlags(0),
        }
    }

    /// Sets the bus state that the command `F` reports, in addition to the frames that this port dropped.
    pub fn set_bus(&mut self, flags: StatusFlags) {
        self.bus = flags;
    }

    /// Returns whether the host has asked for the frames of the bus; without that, answers of diagnosis alone are for it.
    pub const fn is_open(&self) -> bool {
        self.session.open
    }

    /// Appends a frame, instead of the oldest of a full queue. `time` is sent if the host wants time stamps.
    pub fn enqueue(&mut self, frame: DataFrame, time: Micros) {
        self.queue.enqueue((frame, time));
    }

    /// Takes a byte of the host; `take` gets a frame that it completes, and returns whether it is used or refused.
    pub fn receive(&mut self, byte: u8, take: impl FnOnce(DataFrame) -> bool) {
        let dropped = self.queue.dropped();
        let Some(line) = self.assembler.receive(byte) else { return };
        let mut reaction = match line {
            Ok(line) => {
                let reported =
                    if line == b"F" { core::mem::replace(&mut self.reported, dropped) } else { dropped };
                let full = if reported < dropped { StatusFlags::TRANSMIT_FULL.0 } else { 0 };
                self.session.execute(line, StatusFlags(self.bus.0 | full))
            }
            Err(TooLong) => self.session.refuse(),
        };
        if reaction.frame.is_some_and(|frame| !take(frame)) {
            reaction = self.session.refuse();
        }
        // A host that keeps sending commands without reading gets no answer rather than a partial one.
        let fits = self.answers.extend_from_slice(&reaction.answer).is_ok();
        count(&mut self.unanswered, u32::from(!fits));
    }

    /// Returns whether bytes wait to be sent.
    pub fn is_sending(&self) -> bool {
        self.taken < self.length || !self.answers.is_empty() || !self.queue.is_empty()
    }

    /// Returns the bytes to send next: the rest of the current line, else answers, else the oldest frame.
    pub fn outgoing(&mut self) -> Option<&[u8]> {
        if self.taken == self.length {
            (self.taken, self.length) = (0, self.answers.len());
            if let Some(line) = self.line.get_mut(..self.length) {
                line.copy_from_slice(&self.answers);
            }
            self.answers.clear();
        }
        while self.length == 0 {
            let (frame, time) = self.queue.front()?;
            let time = self.session.stamped.then_some(*time);
            let room = self.line.first_chunk_mut();
            // All our frames fit SLCAN; any other is skipped.
            self.length = room.and_then(|room| encode(frame, time, room)).unwrap_or(0);
            let _ = self.queue.pop();
        }
        self.line.get(self.taken..self.length)
    }

    /// Removes bytes of [`Port::outgoing`] that have been sent.
    pub fn sent(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_add(bytes).min(self.length);
    }

    /// Reads and writes as many bytes as the line allows without blocking; `take` is called with the host's frames,
    /// and returns whether a frame is used. An error of the line loses no buffered byte.
    pub fn service<L>(
        &mut self,
        line: &mut L,
        mut take: impl FnMut(DataFrame) -> bool,
    ) -> Result<(), L::Error>
    where
        L: Read + ReadReady + Write + WriteReady,
    {
        for _ in 0..MAX_RECEIVED {
            let mut byte = [0];
            if !line.read_ready()? || line.read(&mut byte)? == 0 {
                break;
            }
            let [byte] = byte;
            self.receive(byte, &mut take);
        }
        while self.is_sending() && line.write_ready()? {
            let Some(outgoing) = self.outgoing() else { break };
            let taken = line.write(outgoing)?;
            if taken == 0 {
                break;
            }
            self.sent(taken);
        }
        Ok(())
    }

    /// Returns the number of dropped frames.
    pub fn dropped(&self) -> u32 {
        self.queue.dropped()
    }

    /// Returns the number of refused lines from the host plus the number of answers for which there was no room.
    pub fn refused(&self) -> u32 {
        self.session.refused.saturating_add(self.unanswered)
    }
}
