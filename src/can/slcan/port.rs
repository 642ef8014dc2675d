//! A port is the device's end of an SLCAN line: it sends frames and executes commands.
//!
//! [`Port`] keeps the bytes and does no I/O; [`Port::service`] moves them over any line that can
//! say whether it is ready (`embedded_io`'s `ReadReady` and `WriteReady`). It never waits: what
//! the line does not take stays, and when the queue is full the oldest frame gives way. A line
//! that was begun is always finished first, so a stalled host reads no torn frame afterwards.

use super::assembler::{LineAssembler, TooLong};
use super::host::{Session, StatusFlags};
use super::{MAX_STAMPED_LINE, StampedLine, emit, emit_stamped};
use crate::can::DataFrame;
use crate::can::queue::TransmitQueue;
use crate::health::count;
use crate::units::Micros;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use heapless::Vec;

/// Characters of answers that may wait: several hosts' greetings.
const MAX_ANSWERS: usize = 64;
/// Bytes taken from the host in one turn, so that a flood cannot hold up the output.
const MAX_RECEIVED: usize = 64;

const _: () = assert!(MAX_ANSWERS > MAX_STAMPED_LINE, "answers are sent the way lines are");

/// The frames that wait, `N` at most.
#[derive(Debug, Clone)]
pub struct Port<const N: usize> {
    session: Session,
    assembler: LineAssembler,
    queue: TransmitQueue<(DataFrame, Micros), N>,
    answers: Vec<u8, MAX_ANSWERS>,
    unanswered: u32,
    /// The line that is being sent, and the number of its bytes that have gone out.
    line: Vec<u8, MAX_ANSWERS>,
    taken: usize,
    /// Drops that have been reported to the host.
    reported: u32,
    bus: StatusFlags,
}

impl<const N: usize> Port<N> {
    /// Begins for a bus of this bit rate, with nothing sent.
    #[must_use]
    pub const fn new(bits_per_second: u32) -> Self {
        Self {
            session: Session::new(bits_per_second),
            assembler: LineAssembler::new(),
            queue: TransmitQueue::new(),
            answers: Vec::new(),
            unanswered: 0,
            line: Vec::new(),
            taken: 0,
            reported: 0,
            bus: StatusFlags(0),
        }
    }

    /// Sets the state of the bus that the command `F` reports; frames that this line dropped are added.
    pub fn set_bus(&mut self, flags: StatusFlags) {
        self.bus = flags;
    }

    /// Puts a frame at the end; the oldest one gives way. `time` is its stamp, should the host
    /// want one.
    pub fn enqueue(&mut self, frame: DataFrame, time: Micros) {
        self.queue.enqueue((frame, time));
    }

    /// Takes a byte from the host; gives the frame that it completes.
    pub fn receive(&mut self, byte: u8) -> Option<DataFrame> {
        let dropped = self.queue.dropped();
        let reaction = match self.assembler.receive(byte)? {
            Ok(line) => {
                let reported =
                    if line == b"F" { core::mem::replace(&mut self.reported, dropped) } else { dropped };
                let full = if reported < dropped { StatusFlags::TRANSMIT_FULL.0 } else { 0 };
                self.session.execute(line, StatusFlags(self.bus.0 | full))
            }
            Err(TooLong) => self.session.refuse(),
        };
        // A host that asks on and on without reading gets no answer, not half of one.
        let fits = self.answers.extend_from_slice(&reaction.answer).is_ok();
        count(&mut self.unanswered, u32::from(!fits));
        reaction.frame
    }

    /// Returns the bytes to send next: the rest of the line under way, else answers, else the oldest frame.
    pub fn outgoing(&mut self) -> Option<&[u8]> {
        if self.taken == self.line.len() {
            self.taken = 0;
            self.line = core::mem::take(&mut self.answers);
        }
        while self.line.is_empty() {
            let (frame, time) = self.queue.pop()?;
            // A frame that SLCAN cannot express is none of ours.
            self.line = self.format(&frame, time).unwrap_or_default();
        }
        self.line.get(self.taken..)
    }

    /// Removes bytes of [`Port::outgoing`] that the line has taken.
    pub fn sent(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_add(bytes).min(self.line.len());
    }

    /// Moves as many bytes from and to the line as it gives and takes without waiting; `frame` gets the host's frames.
    ///
    /// # Errors
    /// The line's own error; only the byte that the line lost is lost.
    pub fn service<L>(&mut self, line: &mut L, mut frame: impl FnMut(DataFrame)) -> Result<(), L::Error>
    where
        L: Read + ReadReady + Write + WriteReady,
    {
        for _ in 0..MAX_RECEIVED {
            let mut byte = [0];
            if !line.read_ready()? || line.read(&mut byte)? == 0 {
                break;
            }
            let [byte] = byte;
            self.receive(byte).into_iter().for_each(&mut frame);
        }
        while line.write_ready()? {
            let Some(outgoing) = self.outgoing() else { break };
            let taken = line.write(outgoing)?;
            if taken == 0 {
                break;
            }
            self.sent(taken);
        }
        Ok(())
    }

    /// Returns the number of frames that gave way to newer ones.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.queue.dropped()
    }

    /// Returns the number of the host's lines that were refused, and of answers that found no room.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.session.refused().saturating_add(self.unanswered)
    }

    fn format(&self, frame: &DataFrame, time: Micros) -> Option<Vec<u8, MAX_ANSWERS>> {
        let line: StampedLine = if self.session.stamped() {
            emit_stamped(frame, time)?
        } else {
            StampedLine::from_slice(&emit(frame)?).ok()?
        };
        Vec::from_slice(&line).ok()
    }
}
