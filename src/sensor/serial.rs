//! This module connects parts on a serial line over the traits of `embedded-io`: the line itself, and the dialogue that
//! configures a part for the pipeline. Nothing here depends on a particular part.
//!
//! No read blocks: a port must say whether bytes wait ([`ReadReady`]), so a silent part costs only a bounded time.
//!
//! There are no async shims. All parsers and dialogues take bytes and a time and do no input or output, so an async
//! caller awaits its own read, pushes the bytes and polls; it needs nothing from this module.

use super::{ByteSource, Source};
use crate::units::Micros;
use embedded_hal::delay::DelayNs;
use embedded_io::{Read, ReadReady, Write};
use heapless::Vec;

/// Length of the longest message that a dialogue sends, bytes.
pub const MAX_SENT: usize = 32;
/// The line is polled this far apart, ms.
const POLL_MS: u32 = 1;
/// Each poll reads at most this many bytes, more than arrive in that time at 921,600 baud.
const CHUNK: usize = 128;
/// One call of [`Serial::next_sample`] reads at most this many bytes.
const MAX_READ: usize = 1024;

/// Names the action that a dialogue asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// The caller sends these bytes.
    Send(Vec<u8, MAX_SENT>),
    /// There is nothing to do; the caller polls again when bytes have come or time has passed.
    Wait,
    /// The part is configured.
    Done,
}

/// Holds a dialogue with a part: bytes and the time in, messages to send out. It ends after a bounded time, whatever
/// the part does.
pub trait Dialogue {
    /// The reason why a dialogue has failed to configure the part.
    type Error: core::error::Error;

    /// Takes one byte from the part.
    fn receive(&mut self, byte: u8);

    /// Returns the next action at `now`.
    ///
    /// # Errors
    /// The reason why the dialogue has failed; it is returned at each later call too.
    fn poll(&mut self, now: Micros) -> Result<Action, Self::Error>;
}

/// The error of a line: of the port or of the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SerialError<P, E> {
    /// The port failed: an overrun, a framing error.
    #[error("the serial port failed: {0:?}")]
    Port(P),
    /// The part's data, or their absence, are wrong.
    #[error(transparent)]
    Part(E),
}

/// Runs a dialogue to its end; `delay` measures the time.
///
/// # Errors
/// [`SerialError::Port`] at once, [`SerialError::Part`] when the dialogue gives up.
pub fn configure<PORT: Read + Write + ReadReady, D: Dialogue>(
    port: &mut PORT,
    dialogue: &mut D,
    delay: &mut impl DelayNs,
) -> Result<(), SerialError<PORT::Error, D::Error>> {
    let mut now = Micros(0);
    loop {
        match dialogue.poll(now).map_err(SerialError::Part)? {
            Action::Done => return Ok(()),
            Action::Send(bytes) => {
                port.write_all(&bytes).and_then(|()| port.flush()).map_err(SerialError::Port)?;
            }
            Action::Wait => {
                let mut chunk = [0; CHUNK];
                for byte in receive(port, &mut chunk).map_err(SerialError::Port)? {
                    dialogue.receive(*byte);
                }
                delay.delay_ms(POLL_MS);
                now.0 += u64::from(POLL_MS) * 1_000;
            }
        }
    }
}

/// Reads a part through a port, as a [`Source`].
#[derive(Debug)]
pub struct Serial<PORT, PART> {
    port: PORT,
    part: PART,
}

impl<PORT, PART> Serial<PORT, PART> {
    /// Makes a source from a port and a configured part.
    #[must_use]
    pub const fn new(port: PORT, part: PART) -> Self {
        Self { port, part }
    }

    /// Returns the part, for its counters.
    pub const fn part(&self) -> &PART {
        &self.part
    }

    /// Returns port and part.
    pub fn destroy(self) -> (PORT, PART) {
        (self.port, self.part)
    }
}

impl<PORT: Read + ReadReady, PART: ByteSource> Source for Serial<PORT, PART> {
    type Sample = PART::Sample;
    type Error = SerialError<PORT::Error, PART::Error>;

    /// Reads the waiting bytes, a bounded number, up to the next sample.
    fn next_sample(&mut self) -> Option<Result<PART::Sample, Self::Error>> {
        for _ in 0..MAX_READ {
            if let Some(sample) = self.part.next_sample() {
                return Some(sample.map_err(SerialError::Part));
            }
            match receive(&mut self.port, &mut [0]) {
                Ok(&[byte]) => self.part.receive(byte),
                Ok(_) => return None,
                Err(error) => return Some(Err(SerialError::Port(error))),
            }
        }
        self.part.next_sample().map(|sample| sample.map_err(SerialError::Part))
    }
}

/// Reads the bytes that are waiting at the port, as many as fit.
fn receive<'a, PORT: Read + ReadReady>(port: &mut PORT, to: &'a mut [u8]) -> Result<&'a [u8], PORT::Error> {
    let count = if port.read_ready()? { port.read(to)? } else { 0 };
    Ok(to.get(..count).unwrap_or_default())
}
