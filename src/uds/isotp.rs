//! ISO 15765-2 (ISO-TP) carries diagnostic messages of more than seven bytes in CAN frames, here with normal
//! addressing.
//!
//! [`Transport`] handles one exchange at a time, without I/O or clock. As receiver it grants [`BLOCK`] frames at a
//! time, so that a queue of that length never overflows. A frame out of sequence ends the message and is counted. As
//! sender it counts the tester's separation time from the end of a frame on the bus, which the caller reports.

use super::signature::TRAILER;
use crate::health::{count, counters};
use crate::service::message::BLOCK as DOWNLOAD_BLOCK;
use crate::store::record::MAX_LEN;
use heapless::Vec;

/// Longest message, bytes: the longest record with service, identifier, layout version and trailer.
pub const MAX_MESSAGE: usize = 4 + MAX_LEN + TRAILER;
const _: () = assert!(
    MAX_MESSAGE >= DOWNLOAD_BLOCK + 2,
    "a message has room for a block of a download, its service and its number"
);
/// Number of frames that the tester may send before it waits for the next flow control.
pub const BLOCK: u8 = 8;
/// Longest wait for the next frame of a message, or for a flow control, ms (N_Cr and N_Bs, ISO 15765-2 9.8).
pub const TIMEOUT_MS: u32 = 1_000;
/// Largest number of successive flow controls with status "wait" (N_WFTmax).
const MAX_WAITS: u8 = 10;
/// Padding byte of short frames (ISO 15765-2 10.4.2.1: fewest stuff bits).
const PADDING: u8 = 0xCC;

pub type Bytes = [u8; 8];

counters! {
    pub struct TransportErrors {
        /// Frames that were unexpected, or had an invalid length, type or flow status.
        pub unexpected: u32,
        /// Messages with a missing or repeated frame.
        pub sequence: u32,
        /// Messages that were too long for us ([`MAX_MESSAGE`]) or for the tester.
        pub overflow: u32,
        /// Messages whose next frame or flow control did not arrive in time.
        pub timeout: u32,
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    /// Consecutive frames are due, the next one by `until`.
    Receiving {
        length: usize,
        sequence: u8,
        granted: u8,
        until: u32,
    },
    /// The request is complete and waits for its response.
    Received,
    /// The flow control of the tester is due by `until`.
    Waiting {
        sent: usize,
        sequence: u8,
        until: u32,
        waits: u8,
    },
    /// Frames are being sent, the next not before `due`, `left` of them before a flow control (0: all). Until the
    /// newest has left, `due` is when it must have (N_As), and no separation time runs.
    Sending {
        sent: usize,
        sequence: u8,
        left: u8,
        gap_ms: u32,
        due: u32,
        has_left: bool,
    },
}

impl State {
    const SENDING: Self = Self::Sending { sent: 0, sequence: 0, left: 0, gap_ms: 0, due: 0, has_left: true };
}

#[derive(Debug)]
pub struct Transport {
    state: State,
    request: Vec<u8, MAX_MESSAGE>,
    response: Vec<u8, MAX_MESSAGE>,
    /// Frame to send before any other: a flow control, or an interim response.
    urgent: Option<Bytes>,
    pub errors: TransportErrors,
}

/// Flow status, high half of the first byte included (ISO 15765-2 9.6.5).
const CONTINUE: u8 = 0x30;
const WAIT: u8 = 0x31;
const OVERFLOW: u8 = 0x32;

impl Transport {
    pub const IDLE: Self = Self {
        state: State::Idle,
        request: Vec::new(),
        response: Vec::new(),
        urgent: None,
        errors: TransportErrors::NONE,
    };

    /// Returns the request once it is complete, until it is answered.
    pub fn request(&self) -> Option<&[u8]> {
        (self.state == State::Received).then_some(&*self.request)
    }

    /// Returns whether no exchange is in progress.
    pub fn is_idle(&self) -> bool {
        self.state == State::Idle && self.urgent.is_none()
    }

    pub fn refuse(&mut self) {
        count(&mut self.errors.unexpected, 1);
    }

    /// Processes the data of a frame received at `now`, in milliseconds of a clock that wraps around.
    pub fn receive(&mut self, data: &[u8], now: u32) {
        match data {
            [head @ 0x00..=0x0F, rest @ ..] => self.single(*head, rest),
            [head @ 0x10..=0x1F, low, rest @ ..] => self.first(*head, *low, rest, now),
            [head @ 0x20..=0x2F, rest @ ..] => self.consecutive(head & 0xF, rest, now),
            [status, block, gap, ..] if status & 0xF0 == 0x30 => self.flow(*status, *block, *gap, now),
            _ => count(&mut self.errors.unexpected, 1),
        }
    }

    fn single(&mut self, head: u8, rest: &[u8]) {
        let length = usize::from(head);
        let Some(bytes) = rest.get(..length).filter(|bytes| !bytes.is_empty() && self.accepts_request())
        else {
            return count(&mut self.errors.unexpected, 1);
        };
        self.request.clear();
        // Seven bytes at most.
        let _ = self.request.extend_from_slice(bytes);
        self.state = State::Received;
    }

    fn first(&mut self, head: u8, low: u8, rest: &[u8], now: u32) {
        let length = usize::from(head & 0xF) << 8 | usize::from(low);
        // Length 0 means that a 32-bit length follows: longer than the buffer.
        let fits = (8..=MAX_MESSAGE).contains(&length);
        if rest.len() != 6 || (1..8).contains(&length) || !self.accepts_request() {
            return count(&mut self.errors.unexpected, 1);
        }
        self.state = State::Idle;
        if !fits {
            count(&mut self.errors.overflow, 1);
            self.urgent = Some(flow_control(OVERFLOW));
            return;
        }
        self.request.clear();
        let _ = self.request.extend_from_slice(rest);
        self.urgent = Some(flow_control(CONTINUE));
        let until = now.wrapping_add(TIMEOUT_MS);
        self.state = State::Receiving { length, sequence: 1, granted: BLOCK, until };
    }

    /// Returns whether a request may begin: an incomplete one gives way, one that waits for its response does not.
    fn accepts_request(&mut self) -> bool {
        if matches!(self.state, State::Receiving { .. }) {
            count(&mut self.errors.sequence, 1);
            self.state = State::Idle;
        }
        self.state == State::Idle
    }

    fn consecutive(&mut self, number: u8, rest: &[u8], now: u32) {
        let State::Receiving { length, sequence, granted, .. } = self.state else {
            return count(&mut self.errors.unexpected, 1);
        };
        let missing = length.saturating_sub(self.request.len());
        let bytes = rest.get(..missing.min(7));
        let Some(bytes) = bytes.filter(|_| number == sequence && granted > 0) else {
            count(&mut self.errors.sequence, 1);
            self.state = State::Idle;
            return;
        };
        // `length` is at most the capacity.
        let _ = self.request.extend_from_slice(bytes);
        if self.request.len() >= length {
            self.state = State::Received;
            return;
        }
        let granted = match granted - 1 {
            0 => {
                self.urgent = Some(flow_control(CONTINUE));
                BLOCK
            }
            left => left,
        };
        let (sequence, until) = (sequence.wrapping_add(1) & 0xF, now.wrapping_add(TIMEOUT_MS));
        self.state = State::Receiving { length, sequence, granted, until };
    }

    fn flow(&mut self, status: u8, block: u8, gap: u8, now: u32) {
        let State::Waiting { sent, sequence, waits, .. } = self.state else {
            return count(&mut self.errors.unexpected, 1);
        };
        self.state = match status {
            CONTINUE => {
                let gap_ms = gap_ms(gap);
                State::Sending { sent, sequence, left: block, gap_ms, due: now, has_left: true }
            }
            WAIT if waits < MAX_WAITS => {
                State::Waiting { sent, sequence, until: now.wrapping_add(TIMEOUT_MS), waits: waits + 1 }
            }
            WAIT => {
                count(&mut self.errors.timeout, 1);
                State::Idle
            }
            OVERFLOW => {
                count(&mut self.errors.overflow, 1);
                State::Idle
            }
            _ => {
                count(&mut self.errors.unexpected, 1);
                State::Idle
            }
        };
    }

    pub fn expire(&mut self, now: u32) {
        if let State::Receiving { until, .. }
        | State::Waiting { until, .. }
        | State::Sending { due: until, has_left: false, .. } = self.state
            && now.wrapping_sub(until) as i32 >= 0
        {
            count(&mut self.errors.timeout, 1);
            self.state = State::Idle;
        }
    }

    /// Sends up to seven bytes as an interim response; the request must still be answered.
    pub fn interim(&mut self, response: &[u8]) {
        self.urgent = Some(frame(&[response.len().min(7) as u8], response));
    }

    /// Begins to send a tester's request, answered in [`Self::request`]; `false` if it is too long.
    pub fn send(&mut self, message: &[u8]) -> bool {
        self.response.clear();
        let fits = self.response.extend_from_slice(message).is_ok();
        if fits {
            self.state = State::SENDING;
        }
        fits
    }

    /// Has `answer` write the response to a complete request, if any, and begins to send it unless it is empty.
    pub fn answer(&mut self, answer: impl FnOnce(&[u8], &mut Vec<u8, MAX_MESSAGE>)) -> bool {
        if self.state != State::Received {
            return false;
        }
        self.response.clear();
        answer(&self.request, &mut self.response);
        self.state = match self.response.is_empty() {
            true => State::Idle,
            false => State::SENDING,
        };
        true
    }

    /// Notes that all frames have left by `now`, perhaps the millisecond's begin: the separation time begins.
    pub fn frames_left(&mut self, now: u32) {
        if let State::Sending { gap_ms, due, has_left, .. } = &mut self.state
            && !core::mem::replace(has_left, true)
        {
            *due = now.wrapping_add(*gap_ms + 1);
        }
    }

    /// Returns the next frame to send, if one is due. [`Self::frames_left`] must be called once it has left.
    pub fn next_frame(&mut self, now: u32) -> Option<Bytes> {
        if let Some(urgent) = self.urgent.take() {
            return Some(urgent);
        }
        let State::Sending { sent, sequence, left, gap_ms, due, has_left } = self.state else { return None };
        let length = self.response.len();
        if sent == 0 {
            let (head, taken) = match length {
                0..=7 => (Vec::<u8, 2>::from_slice(&[length as u8]), length),
                _ => (Vec::from_slice(&[0x10 | (length >> 8) as u8, length as u8]), 6),
            };
            let until = now.wrapping_add(TIMEOUT_MS);
            self.state = match taken == length {
                true => State::Idle,
                false => State::Waiting { sent: taken, sequence: 1, until, waits: 0 },
            };
            return Some(frame(&head.unwrap_or_default(), self.response.get(..taken).unwrap_or_default()));
        }
        if !has_left || (now.wrapping_sub(due) as i32) < 0 {
            return None;
        }
        let end = length.min(sent + 7);
        let next = sequence.wrapping_add(1) & 0xF;
        self.state = match left {
            _ if end == length => State::Idle,
            1 => State::Waiting { sent: end, sequence: next, until: now.wrapping_add(TIMEOUT_MS), waits: 0 },
            _ => {
                let (left, has_left) = (left.saturating_sub(1), gap_ms == 0);
                let due = if has_left { now } else { now.wrapping_add(TIMEOUT_MS) };
                State::Sending { sent: end, sequence: next, left, gap_ms, due, has_left }
            }
        };
        Some(frame(&[0x20 | sequence], self.response.get(sent..end).unwrap_or_default()))
    }
}

/// Returns a flow control with this status, a block size of [`BLOCK`] and no separation time.
const fn flow_control(status: u8) -> Bytes {
    [status, BLOCK, 0, PADDING, PADDING, PADDING, PADDING, PADDING]
}

fn frame(head: &[u8], bytes: &[u8]) -> Bytes {
    let mut frame = [PADDING; 8];
    frame.iter_mut().zip(head.iter().chain(bytes)).for_each(|(place, byte)| *place = *byte);
    frame
}

/// Returns a separation time, rounded up to ms; reserved codes mean the longest (ISO 15765-2 9.6.5.5).
fn gap_ms(code: u8) -> u32 {
    match code {
        0..=0x7F => u32::from(code),
        0xF1..=0xF9 => 1,
        _ => 0x7F,
    }
}
