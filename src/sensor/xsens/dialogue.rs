//! This dialogue configures an MTi to send what the pipeline needs.
//!
//! It sends GoToConfig, SetOutputConfiguration and GoToMeasurement; the sensor answers each with its identifier plus
//! one. The rules:
//! - A message without an answer within [`TIMEOUT`] is sent again, up to [`ATTEMPTS`] times in total.
//! - An error frame counts as an attempt, and the message is sent again at once.
//! - The sensor may set outputs other than those requested, and reports them in its acknowledgement. An
//!   acceleration or rate of turn at another rate ends the dialogue.
//! - A sensor that wakes up (MID 3E) must be answered within 500 ms, so poll at least that often; it
//!   is then in configuration mode. The dialogue fails if a sensor keeps restarting, as it
//!   does if a sensor does not answer.
//! - Measurements that still arrive are skipped.
//!
//! The dialogue does no I/O and has no clock: bytes and the time are inputs, frames to send are outputs.

pub use super::setup::{OUTPUTS, Output, Step, mid};
pub use crate::sensor::serial::Action;

use super::mtdata2::id;
use super::xbus::{self, MAX_FRAME, Xbus};
use crate::sensor::framer::Framer;
use crate::sensor::serial;
use crate::units::{Duration, Micros};

/// Longest wait for an answer.
pub const TIMEOUT: Duration = Duration::from_millis(500);
/// Number of times that a message is sent before the dialogue fails.
pub const ATTEMPTS: u8 = 3;
/// The reason why the dialogue has failed to configure the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DialogueError {
    /// No attempt was answered.
    #[error("MTi: no answer to {step:?} after {ATTEMPTS} attempts")]
    Silent {
        /// Step that was not answered.
        step: Step,
    },
    /// The last attempt was answered with an error frame.
    #[error("MTi: {step:?} was refused with error {code}")]
    Refused {
        /// Step that was refused.
        step: Step,
        /// Error code of the sensor.
        code: u8,
    },
    /// The sensor has restarted more than [`ATTEMPTS`] times: its supply is unstable, or it resets itself.
    #[error("MTi: restarted more than {ATTEMPTS} times")]
    Restarts,
    /// The sensor has set a rate other than the requested one, or has omitted the output (rate 0).
    #[error("MTi: output {id:04x} is set to {rate} Hz")]
    Output {
        /// Data identifier.
        id: u16,
        /// Rate that the sensor has set, Hz.
        rate: u16,
    },
}

/// The current step of the dialogue and its progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// The message of this step must be sent.
    Due(Step),
    /// The message was sent; the answer is due by this time.
    Sent(Step, Micros),
    Done,
    Failed(DialogueError),
}

/// The dialogue with one sensor.
#[derive(Debug, Clone)]
pub struct Dialogue {
    framer: Framer<Xbus, MAX_FRAME>,
    state: State,
    /// Number of attempts at the current step.
    attempts: u8,
    last_error: Option<u8>,
    /// Whether the sensor has woken up and waits for the acknowledgement.
    woken: bool,
    /// Number of times that the sensor has woken up.
    starts: u8,
}

impl Default for Dialogue {
    fn default() -> Self {
        Self::new()
    }
}

impl Dialogue {
    /// Creates a dialogue that has sent nothing.
    #[must_use]
    pub const fn new() -> Self {
        let state = State::Due(Step::GoToConfig);
        Self { framer: Framer::new(), state, attempts: 0, last_error: None, woken: false, starts: 0 }
    }

    /// Processes one byte from the sensor.
    pub fn receive(&mut self, byte: u8) {
        self.framer.receive(byte);
        while let Some((mid, reply)) = self.framer.next_frame().and_then(xbus::parse).map(Reply::new) {
            self.answer(mid, reply);
        }
    }

    /// Returns the next action at `now`.
    ///
    /// # Errors
    /// [`DialogueError`]; every later call returns the same error.
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

/// The relevant data of a received frame, for any message.
struct Reply {
    /// Code of an error frame.
    code: u8,
    /// First required output whose rate differs from the request.
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
