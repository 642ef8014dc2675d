//! This dialogue configures a DSP-1760.
//!
//! The gyro acknowledges no setting, so the dialogue queries the rate afterwards: it sends the lines of [`setup`],
//! then the query for the rate, and leaves configuration mode only after the answer. The rules:
//! - Lines are sent [`PAUSE`] apart.
//! - Without an answer within [`TIMEOUT`], or if the answer is another rate, all lines are sent again,
//!   up to [`ATTEMPTS`] times in total.
//! - Bytes before an answer in its line (from messages that still arrive) are skipped.
//!
//! The dialogue does no I/O and has no clock: bytes and the time are inputs, lines to send are outputs. Create the
//! parser ([`super::Dsp1760::new`]) afterwards, with the rate that was set.

use super::command::{Command, MAX_LINE, Reply, setup};
use super::config::{Dsp1760Config, OutputRate};
use crate::sensor::serial::{self, Action};
use crate::units::{Duration, Micros};
use heapless::Vec;

/// Time between two lines.
pub const PAUSE: Duration = Duration::from_millis(20);
/// Longest wait for the answer.
pub const TIMEOUT: Duration = Duration::from_millis(500);
/// Number of attempts before the dialogue fails.
pub const ATTEMPTS: u8 = 3;

/// The reason why the dialogue has failed to configure the gyro.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DialogueError {
    /// No query was answered.
    #[error("DSP-1760: no answer after {ATTEMPTS} attempts")]
    Silent,
    /// The last answer reported a rate other than the one that was set.
    #[error("DSP-1760: the rate stays at {} Hz", .got.hertz())]
    Rate {
        /// Rate that the gyro reports.
        got: OutputRate,
    },
}

/// The dialogue with one gyro.
#[derive(Debug, Clone)]
pub struct Dialogue {
    config: Dsp1760Config,
    /// The newest bytes of the line being received.
    line: Vec<u8, MAX_LINE>,
    /// Index of the line to send next.
    next: usize,
    due: Micros,
    attempts: u8,
    /// Last answer to the query.
    answer: Option<OutputRate>,
}

impl Dialogue {
    /// Creates a dialogue that has sent nothing.
    #[must_use]
    pub const fn new(config: Dsp1760Config) -> Self {
        Self { config, line: Vec::new(), next: 0, due: Micros(0), attempts: 1, answer: None }
    }

    /// Returns all lines in order. The last line is sent once the query has been answered.
    fn lines(&self) -> [Command; 6] {
        let [enter, rate, rotation, temperature, leave] = setup(&self.config);
        [enter, rate, rotation, temperature, Command::QueryRate, leave]
    }
}

impl serial::Dialogue for Dialogue {
    type Error = DialogueError;

    fn receive(&mut self, byte: u8) {
        if byte != b'\n' {
            if self.line.is_full() {
                self.line.remove(0);
            }
            // Cannot fail: the buffer has room now.
            let _ = self.line.push(byte);
            return;
        }
        let begin = self.line.windows(3).rposition(|word| word.eq_ignore_ascii_case(b"dr,"));
        let reply = begin.and_then(|begin| self.line.get(begin..)).and_then(Reply::parse);
        if let Some(Reply::Rate(rate)) = reply {
            self.answer = Some(rate);
        }
        self.line.clear();
    }

    fn poll(&mut self, now: Micros) -> Result<Action, DialogueError> {
        let lines = self.lines();
        let leave = lines.len() - 1;
        let set = self.answer == Some(self.config.rate);
        if now < self.due && !(self.next == leave && set) {
            return Ok(Action::Wait);
        }
        if self.next == leave && !set {
            // The query has timed out.
            if self.attempts == ATTEMPTS {
                return Err(self.answer.map_or(DialogueError::Silent, |got| DialogueError::Rate { got }));
            }
            self.attempts += 1;
            self.next = 0;
        }
        let Some(command) = lines.get(self.next) else { return Ok(Action::Done) };
        if self.next == 0 {
            self.answer = None;
        }
        self.next += 1;
        let pause = if self.next == leave { TIMEOUT } else { PAUSE };
        self.due = now.after(pause);
        Ok(Action::Send(command.emit().into_bytes().into_iter().collect()))
    }
}
