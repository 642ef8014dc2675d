//! The client of the service line: it sends requests and reads replies over anything that carries bytes.

pub mod calibration;
pub mod line;
pub mod settings;
pub mod upload;

use crate::client::connection::{ConnectError, is_silence};
use gyronet::service::frame::{Deframer, FrameError, emit};
use gyronet::service::message::Refusal;
use gyronet::service::{Reply, Request};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// The longest time that an answer may take.
const ANSWER: Duration = Duration::from_secs(2);
/// The longest time that the board may take to erase a slot: twice the datasheet's worst case.
const ERASURE: Duration = Duration::from_secs(8);
/// Times that a question is put.
const ATTEMPTS: u32 = 3;

/// The error of a question without the expected answer.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The line cannot be opened.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The line cannot be used.
    #[error("{port}: {source}")]
    Line {
        /// Its name.
        port: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// No answer came.
    #[error(
        "{port}: no answer to {ATTEMPTS} attempts; is this the service line, and is the board \
         running? ({strays} frames were no answers{})",
        .last.map(|error| format!(", the last one: {error}")).unwrap_or_default()
    )]
    Silence {
        /// The line.
        port: String,
        /// Frames that came and were no answer.
        strays: u32,
        /// The reason why the last of them was none.
        last: Option<FrameError>,
    },
    /// The board said no.
    #[error("the board refuses: {0}")]
    Refused(Refusal),
    /// The board answered something else than was asked.
    #[error("the board gave an answer to another question")]
    Mismatch,
    /// A request that is longer than a frame.
    #[error("the request does not fit a frame")]
    TooLong,
}

/// A board at the other end of a line.
pub struct Device<L> {
    line: L,
    port: String,
    number: u8,
}

impl<L: Read + Write> Device<L> {
    /// A board on an open line, whose reads return after a short while with what there is.
    pub fn new(line: L, port: &str) -> Self {
        Self { line, port: port.to_owned(), number: 0 }
    }

    /// Puts a question until it is answered.
    ///
    /// # Errors
    /// [`DeviceError`]; a refusal is one.
    pub fn ask(&mut self, request: &Request) -> Result<Reply, DeviceError> {
        let limit = if matches!(request, Request::WeightsBegin { .. }) { ERASURE } else { ANSWER };
        let (mut strays, mut last) = (0, None);
        for _ in 0..ATTEMPTS {
            self.number = self.number.wrapping_add(1);
            let frame = emit(self.number, request).ok_or(DeviceError::TooLong)?;
            self.line.write_all(&frame).and_then(|()| self.line.flush()).map_err(|e| self.broken(e))?;
            match self.answer(limit, &mut strays, &mut last)? {
                Some(Reply::Refused(refusal)) => return Err(DeviceError::Refused(refusal)),
                Some(reply) => return Ok(reply),
                None => {}
            }
        }
        Err(DeviceError::Silence { port: self.port.clone(), strays, last })
    }

    /// The answer to the last question, if it comes in time.
    fn answer(
        &mut self,
        limit: Duration,
        strays: &mut u32,
        last: &mut Option<FrameError>,
    ) -> Result<Option<Reply>, DeviceError> {
        let until = Instant::now() + limit;
        let mut deframer = Deframer::new();
        let mut bytes = [0; 512];
        while Instant::now() < until {
            let len = match self.line.read(&mut bytes) {
                Ok(0) => return Err(self.broken(ErrorKind::UnexpectedEof.into())),
                Ok(len) => len,
                Err(error) if is_silence(&error) => continue,
                Err(error) => return Err(self.broken(error)),
            };
            for byte in &bytes[..len] {
                match deframer.receive(*byte) {
                    Some(Ok((number, reply))) if number == self.number => return Ok(Some(reply)),
                    // Late, to an earlier question.
                    Some(Ok(_)) => *strays += 1,
                    Some(Err(error)) => {
                        *strays += 1;
                        *last = Some(error);
                    }
                    None => {}
                }
            }
        }
        Ok(None)
    }

    fn broken(&self, source: std::io::Error) -> DeviceError {
        DeviceError::Line { port: self.port.clone(), source }
    }
}
