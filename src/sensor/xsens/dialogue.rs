//! This dialogue configures an MTi to send what the pipeline needs.
//!
//! It sends GoToConfig, SetOutputConfiguration and GoToMeasurement; the part answers each with its identifier plus one.
//! The rules:
//! - A message without an answer for [`TIMEOUT`] is sent again, [`ATTEMPTS`] times in all.
//! - An error frame counts as an attempt, and the message is sent again at once.
//! - The part may set other outputs than asked for, and says so in its acknowledgement: an
//!   acceleration or rate of turn at another rate ends the dialogue.
//! - A part that wakes up (MID 3E) is answered within 500 ms if the caller polls that often; it
//!   is in configuration mode then. The dialogue gives up a part that keeps restarting, as it
//!   does one that does not answer.
//! - Measurements that still come in are skipped.
//!
//! The dialogue needs no port and no clock: bytes and the time come in, frames to send come out.

pub use super::setup::{OUTPUTS, Output, Step, mid};
pub use crate::sensor::serial::Action;

use super::mtdata2::id;
use super::xbus::{self, MAX_FRAME, Xbus};
use crate::sensor::framer::Framer;
use crate::sensor::serial;
use crate::units::{Duration, Micros};

/// An answer may take this long.
pub const TIMEOUT: Duration = Duration::from_millis(500);
/// A message is sent this many times before the dialogue gives up.
pub const ATTEMPTS: u8 = 3;
/// The reason why the dialogue has failed to configure the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DialogueError {
    /// No attempt was answered.
    #[error("MTi: no answer to {step:?} after {ATTEMPTS} attempts")]
    Silent {
        /// The step that was not answered.
        step: Step,
    },
    /// The last attempt was answered by an error frame.
    #[error("MTi: {step:?} is refused with error {code}")]
    Refused {
        /// The step that was refused.
        step: Step,
        /// The part's error code.
        code: u8,
    },
    /// The part has woken up more than [`ATTEMPTS`] times: its supply fails, or it resets itself.
    #[error("MTi: restarted more than {ATTEMPTS} times")]
    Restarts,
    /// The part has set a different rate from the one requested, or left the output out (rate 0).
    #[error("MTi: output {id:04x} is set to {rate} Hz")]
    Output {
        /// Data identifier.
        id: u16,
        /// The rate that the part has set, Hz.
        rate: u16,
    },
}

/// Holds the step of the dialogue and how far it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// The message of this step is to be sent.
    Due(Step),
    /// The message was sent, and its answer is due by this time.
    Sent(Step, Micros),
    Done,
    Failed(DialogueError),
}

/// Holds the state of the dialogue with one part.
#[derive(Debug, Clone)]
pub struct Dialogue {
    framer: Framer<Xbus, MAX_FRAME>,
    state: State,
    /// Attempts at the current step.
    attempts: u8,
    last_error: Option<u8>,
    /// The part has woken up and waits for the answer.
    woken: bool,
    /// Times that the part has woken up.
    starts: u8,
}

impl Default for Dialogue {
    fn default() -> Self {
        Self::new()
    }
}

impl Dialogue {
    /// Begins before the first message is sent.
    #[must_use]
    pub const fn new() -> Self {
        let state = State::Due(Step::GoToConfig);
        Self { framer: Framer::new(), state, attempts: 0, last_error: None, woken: false, starts: 0 }
    }

    /// Takes one byte from the part.
    pub fn receive(&mut self, byte: u8) {
        self.framer.receive(byte);
        while let Some((mid, reply)) = self.framer.next_frame().and_then(xbus::parse).map(Reply::new) {
            self.answer(mid, reply);
        }
    }

    /// Returns the next action at `now`.
    ///
    /// # Errors
    /// [`DialogueError`], which is returned at each later call too: the dialogue is over.
    pub fn poll(&mut self, now: Micros) -> Result<Action, DialogueError> {
        if core::mem::take(&mut self.woken) {
            return Ok(Action::Send(xbus::emit(mid::WAKE_UP_ACK, &[]).unwrap_or_default()));
        }
        if let State::Sent(step, until) = self.state
            && now >= until
        {
            self.state = State::Due(step);
        }
        match self.state {
            State::Due(step) if self.attempts == ATTEMPTS => {
                let error = match self.last_error {
                    Some(code) => DialogueError::Refused { step, code },
                    None => DialogueError::Silent { step },
                };
                self.state = State::Failed(error);
                Err(error)
            }
            State::Due(step) => {
                self.attempts += 1;
                self.last_error = None;
                self.state = State::Sent(step, now.after(TIMEOUT));
                Ok(Action::Send(step.emit()))
            }
            State::Sent(..) => Ok(Action::Wait),
            State::Done => Ok(Action::Done),
            State::Failed(error) => Err(error),
        }
    }

    fn answer(&mut self, mid: u8, reply: Reply) {
        if mid == mid::WAKE_UP && !matches!(self.state, State::Done | State::Failed(_)) {
            self.starts += 1;
            if self.starts > ATTEMPTS {
                self.state = State::Failed(DialogueError::Restarts);
            } else {
                self.woken = true;
                self.proceed(Step::SetOutputConfiguration);
            }
            return;
        }
        let State::Sent(step, _) = self.state else { return };
        if mid == mid::ERROR {
            self.last_error = Some(reply.code);
            self.state = State::Due(step);
        } else if mid == step.mid() + 1 {
            match (step, reply.different) {
                (Step::GoToConfig, _) => self.proceed(Step::SetOutputConfiguration),
                (Step::SetOutputConfiguration, Some(Output { id, rate })) => {
                    self.state = State::Failed(DialogueError::Output { id, rate });
                }
                (Step::SetOutputConfiguration, None) => self.proceed(Step::GoToMeasurement),
                (Step::GoToMeasurement, _) => self.state = State::Done,
            }
        }
    }

    fn proceed(&mut self, step: Step) {
        self.state = State::Due(step);
        self.attempts = 0;
    }
}

impl serial::Dialogue for Dialogue {
    type Error = DialogueError;

    fn receive(&mut self, byte: u8) {
        self.receive(byte);
    }

    fn poll(&mut self, now: Micros) -> Result<Action, DialogueError> {
        self.poll(now)
    }
}

/// Holds the relevant part of a frame's data, whatever its message is.
struct Reply {
    /// The code of an error frame.
    code: u8,
    /// The first required output whose rate differs from the request.
    different: Option<Output>,
}

impl Reply {
    fn new((mid, data): (u8, &[u8])) -> (u8, Self) {
        let code = data.first().copied().unwrap_or_default();
        let (words, _) = data.as_chunks::<4>();
        let set = |id: u16| {
            let word = words.iter().find(|[hi, lo, ..]| u16::from_be_bytes([*hi, *lo]) == id);
            word.map_or(0, |[.., hi, lo]| u16::from_be_bytes([*hi, *lo]))
        };
        let counts =
            OUTPUTS.iter().filter(|output| [id::ACCELERATION, id::RATE_OF_TURN].contains(&output.id));
        let mut set = counts.map(|output| (output.rate, Output { id: output.id, rate: set(output.id) }));
        let different = set.find(|(rate, set)| *rate != set.rate).map(|(_, set)| set);
        (mid, Self { code, different })
    }
}
