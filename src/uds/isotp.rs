//! ISO 15765-2 carries diagnostic messages of more than seven bytes in CAN frames, here with normal addressing.
//!
//! [`Transport`] has one conversation at a time: it assembles a request, is given the response, and cuts it into
//! frames at the pace that the tester asks for. It does no input or output and knows no clock; both come in as
//! arguments. As receiver it grants [`BLOCK`] frames at a time, so that a queue of that length before it never
//! overflows. Whatever breaks the order of a message ends it, is counted, and leaves room for the next one.

use super::signature::TRAILER;
use crate::health::count;
use crate::service::message::BLOCK as DOWNLOAD_BLOCK;
use crate::store::record::MAX_LEN;
use heapless::Vec;

/// Longest message, bytes: the longest record with its service, identifier, layout and trailer.
pub const LONGEST: usize = 4 + MAX_LEN + TRAILER;
const _: () =
    assert!(LONGEST >= DOWNLOAD_BLOCK + 2, "a block of a download with its service and number fits");
/// Frames that the tester may send before it waits for the next flow control.
pub const BLOCK: u8 = 8;
/// Longest wait for the next frame of a message, or for a flow control, ms (N_Cr and N_Bs, ISO 15765-2 9.8).
pub const TIMEOUT_MS: u32 = 1_000;
/// Flow controls in a row that may ask us to wait (N_WFTmax).
const MOST_WAITS: u8 = 10;
/// Fills the rest of a frame (ISO 15765-2 10.4.2.1: fewest stuff bits).
const PADDING: u8 = 0xCC;

/// The eight bytes of a frame.
pub type Bytes = [u8; 8];

/// Counts conversations that went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TransportErrors {
    /// Frames with a length, type or flow status that the standard does not have, or that nobody waited for.
    pub unexpected: u32,
    /// Messages with a frame missing or repeated.
    pub sequence: u32,
    /// Messages longer than [`LONGEST`], ours or the tester's.
    pub overflow: u32,
    /// Messages whose next frame or flow control did not come in time.
    pub timeout: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    /// Consecutive frames come, until a time.
    Receiving {
        length: usize,
        sequence: u8,
        granted: u8,
        until: u32,
    },
    /// The request is whole and waits for its response.
    Received,
    /// The flow control of the tester is due, by a time.
    Waiting {
        sent: usize,
        sequence: u8,
        until: u32,
        waits: u8,
    },
    /// Consecutive frames go out, the next one not before a time; `left`: frames to the next flow control, 0 for all.
    Sending {
        sent: usize,
        sequence: u8,
        left: u8,
        gap_ms: u32,
        due: u32,
    },
}

/// Holds one conversation with a tester.
#[derive(Debug)]
pub struct Transport {
    state: State,
    request: Vec<u8, LONGEST>,
    response: Vec<u8, LONGEST>,
    /// Goes out before anything else: a flow control, or an interim response.
    urgent: Option<Bytes>,
    errors: TransportErrors,
}

impl Default for Transport {
    fn default() -> Self {
        Self::new()
    }
}

/// Flow status, high half of the first byte included (ISO 15765-2 9.6.5).
const CONTINUE: u8 = 0x30;
const WAIT: u8 = 0x31;
const OVERFLOW: u8 = 0x32;

impl Transport {
    /// Makes an idle transport.
    #[must_use]
    pub const fn new() -> Self {
        let errors = TransportErrors { unexpected: 0, sequence: 0, overflow: 0, timeout: 0 };
        Self { state: State::Idle, request: Vec::new(), response: Vec::new(), urgent: None, errors }
    }

    /// Returns the counts of conversations that went wrong.
    #[must_use]
    pub fn errors(&self) -> TransportErrors {
        self.errors
    }

    /// Returns the request, once it is whole and until it is answered.
    #[must_use]
    pub fn request(&self) -> Option<&[u8]> {
        (self.state == State::Received).then_some(&*self.request)
    }

    /// Returns whether no conversation is under way.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.state == State::Idle && self.urgent.is_none()
    }

    /// Counts a frame that is not taken.
    pub fn refuse(&mut self) {
        count(&mut self.errors.unexpected, 1);
    }

    /// Takes a frame's data at `now`, in milliseconds of a clock that wraps around.
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
        let Some(bytes) = rest.get(..length).filter(|bytes| !bytes.is_empty() && self.takes_requests())
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
        // Length 0 announces 32 bits of length: more than fits.
        let fits = (8..=LONGEST).contains(&length);
        if rest.len() != 6 || (1..8).contains(&length) || !self.takes_requests() {
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

    /// Returns whether a new request may begin: one that comes takes the place of one that is not whole, and must wait
    /// for the response to one that is.
    fn takes_requests(&mut self) -> bool {
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
            CONTINUE => State::Sending { sent, sequence, left: block, gap_ms: gap_ms(gap), due: now },
            WAIT if waits < MOST_WAITS => {
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

    /// Ends a wait that has lasted too long.
    pub fn expire(&mut self, now: u32) {
        if let State::Receiving { until, .. } | State::Waiting { until, .. } = self.state
            && now.wrapping_sub(until) as i32 >= 0
        {
            count(&mut self.errors.timeout, 1);
            self.state = State::Idle;
        }
    }

    /// Sends up to seven bytes now; the request stays and is still to be answered.
    pub fn interim(&mut self, response: &[u8]) {
        self.urgent = Some(frame(&[response.len().min(7) as u8], response));
    }

    /// Begins to send a message, as a tester does; the response comes as a request does. Returns whether it is not longer
    /// than [`LONGEST`].
    pub fn send(&mut self, message: &[u8]) -> bool {
        self.response.clear();
        let fits = self.response.extend_from_slice(message).is_ok();
        if fits {
            self.state = State::Sending { sent: 0, sequence: 0, left: 0, gap_ms: 0, due: 0 };
        }
        fits
    }

    /// Has `answer` write the response to the request, if there is one, and begins to send it; an empty one ends the
    /// request without a response. Returns whether there was a request.
    pub fn answer(&mut self, answer: impl FnOnce(&[u8], &mut Vec<u8, LONGEST>)) -> bool {
        if self.state != State::Received {
            return false;
        }
        self.response.clear();
        answer(&self.request, &mut self.response);
        self.state = match self.response.is_empty() {
            true => State::Idle,
            false => State::Sending { sent: 0, sequence: 0, left: 0, gap_ms: 0, due: 0 },
        };
        true
    }

    /// Returns the next frame that is due, for the bus.
    pub fn next_frame(&mut self, now: u32) -> Option<Bytes> {
        if let Some(urgent) = self.urgent.take() {
            return Some(urgent);
        }
        let State::Sending { sent, sequence, left, gap_ms, due } = self.state else { return None };
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
        if (now.wrapping_sub(due) as i32) < 0 {
            return None;
        }
        let end = length.min(sent + 7);
        let next = sequence.wrapping_add(1) & 0xF;
        self.state = match left {
            _ if end == length => State::Idle,
            1 => State::Waiting { sent: end, sequence: next, until: now.wrapping_add(TIMEOUT_MS), waits: 0 },
            _ => {
                let left = left.saturating_sub(1);
                State::Sending { sent: end, sequence: next, left, gap_ms, due: now.wrapping_add(gap_ms) }
            }
        };
        Some(frame(&[0x20 | sequence], self.response.get(sent..end).unwrap_or_default()))
    }
}

/// Returns a flow control of this status: [`BLOCK`] frames, as fast as they come.
const fn flow_control(status: u8) -> Bytes {
    [status, BLOCK, 0, PADDING, PADDING, PADDING, PADDING, PADDING]
}

/// Returns a frame with these bytes and padding.
fn frame(head: &[u8], bytes: &[u8]) -> Bytes {
    let mut frame = [PADDING; 8];
    frame.iter_mut().zip(head.iter().chain(bytes)).for_each(|(place, byte)| *place = *byte);
    frame
}

/// Returns the separation time that a flow control asks for, rounded up to milliseconds; reserved values are the
/// longest (ISO 15765-2 9.6.5.5).
fn gap_ms(code: u8) -> u32 {
    match code {
        0..=0x7F => u32::from(code),
        0xF1..=0xF9 => 1,
        _ => 0x7F,
    }
}
