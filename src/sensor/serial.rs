//! This module connects sensors to a serial port through the traits of `embedded-io`: it reads samples, and runs the
//! dialogue that configures a sensor for the pipeline. Nothing here depends on a particular sensor.
//!
//! No read blocks: a port must report whether bytes are waiting ([`ReadReady`]), so a silent sensor costs only a
//! bounded time.
//!
//! There are no async wrappers. All parsers and dialogues accept bytes and a time and do no I/O, so an async
//! caller awaits its own read, passes the bytes and polls, without using this module.

use super::{ByteSource, Source};
use crate::units::Micros;
use embedded_hal::delay::DelayNs;
use embedded_io::{Read, ReadReady, Write};
use heapless::Vec;

/// Length of the longest message that a dialogue sends, bytes.
pub const MAX_SENT: usize = 32;
/// Time between two polls of the port, ms.
const POLL_MS: u32 = 1;
/// Largest number of bytes read per poll; more than arrive in that time at 921,600 baud.
const CHUNK: usize = 128;
/// Largest number of bytes read by one call of [`Serial::next_sample`].
const MAX_READ: usize = 1024;

/// The action that a dialogue requests from its caller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Send these bytes.
    Send(Vec<u8, MAX_SENT>),
    /// Do nothing; poll again when bytes have arrived or time has passed.
    Wait,
    /// The sensor is configured.
    Done,
}

/// A dialogue that configures a sensor. Its inputs are bytes and the time, its outputs are messages to send. It ends
/// within a bounded time, whatever the sensor does.
pub trait Dialogue {
    /// The reason why a dialogue has failed to configure the sensor.
    type Error: core::error::Error;

    /// Processes one byte from the sensor.
    fn receive(&mut self, byte: u8);

    /// Returns the next action at `now`.
    ///
    /// # Errors
    /// The reason why the dialogue has failed; every later call returns the same error.
    fn poll(&mut self, now: Micros) -> Result<Action, Self::Error>;
}

/// The error of a serial sensor: of the port or of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SerialError<P, E> {
    /// The port failed, for example by an overrun or a framing error.
    #[error("the serial port failed: {0:?}")]
    Port(P),
    /// The data of the sensor are wrong, or missing.
    #[error(transparent)]
    Part(E),
}

/// Runs a dialogue to its end; `delay` provides the time base.
///
/// # Errors
/// [`SerialError::Port`] at once, [`SerialError::Part`] when the dialogue fails.
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

/// A sensor on a serial port, as a [`Source`].
#[derive(Debug)]
pub struct Serial<PORT, PART> {
    port: PORT,
    part: PART,
}

impl<PORT, PART> Serial<PORT, PART> {
    /// Creates a source from a port and the parser of a configured sensor.
    #[must_use]
    pub const fn new(port: PORT, part: PART) -> Self {
        Self { port, part }
    }

    /// Returns the parser, for its counters.
    pub const fn part(&self) -> &PART {
        &self.part
    }

    /// Releases port and parser.
    pub fn destroy(self) -> (PORT, PART) {
        (self.port, self.part)
    }
}

impl<PORT: Read + ReadReady, PART: ByteSource> Source for Serial<PORT, PART> {
    type Sample = PART::Sample;
    type Error = SerialError<PORT::Error, PART::Error>;

    /// Reads waiting bytes until they complete a sample; at most `MAX_READ` bytes.
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

/// Reads the bytes that are waiting at the port, up to the length of `to`.
fn receive<'a, PORT: Read + ReadReady>(port: &mut PORT, to: &'a mut [u8]) -> Result<&'a [u8], PORT::Error> {
    let count = if port.read_ready()? { port.read(to)? } else { 0 };
    Ok(to.get(..count).unwrap_or_default())
}
