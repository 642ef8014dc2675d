//! A source of frames is a serial port, a TCP socket, or a log.
//!
//! No read lasts longer than [`WAIT`], so that the caller can check the time, redraw, or end.

use super::line::Splitter;
use crate::client::connection::{ConnectError, Connection, is_silence};
use gyronet::can::slcan::host::bit_rate_digit;
use std::fmt;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Duration;

pub const WAIT: Duration = Duration::from_millis(100);

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    #[error(transparent)]
    Connect(#[from] ConnectError),
    #[error("{name}: {source}")]
    Open { name: String, source: io::Error },
    #[error("{name}: {source}")]
    Read { name: String, source: io::Error },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lines {
    /// The received lines; empty if none arrived within [`WAIT`].
    Some(Vec<String>),
    /// The log is at its end, or the other end has closed the connection.
    End,
}

enum Kind {
    Line(Connection),
    Log(File),
}

pub struct Source {
    name: String,
    kind: Kind,
    splitter: Splitter,
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Source").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Source {
    /// Opens a source: a file is a log, `host:port` a socket, anything else a serial port at `baud` bit/s. A line
    /// gets SLCAN's commands to set the bit rate and open, which adapters need; a board does not.
    pub fn open(name: &str, baud: u32, bus_bits_per_second: u32) -> Result<Self, SourceError> {
        let kind = if Path::new(name).is_file() {
            let open = |source| SourceError::Open { name: name.into(), source };
            Kind::Log(File::open(name).map_err(open)?)
        } else {
            Kind::Line(Connection::open(name, baud, WAIT)?)
        };
        let mut source = Self { name: name.into(), kind, splitter: Splitter::default() };
        let rate = bit_rate_digit(bus_bits_per_second).map(char::from);
        let rate = rate.map(|digit| format!("S{digit}\r")).unwrap_or_default();
        // The first CR ends a line that may be left in the adapter's buffer.
        source.say(&format!("\rC\r{rate}O\r")).map_err(|error| source.broken(error))?;
        Ok(source)
    }

    /// Returns whether the source is a log, whose time stamps are the only clock.
    pub fn is_log(&self) -> bool {
        matches!(self.kind, Kind::Log(_))
    }

    /// Returns the received lines, after at most [`WAIT`].
    pub fn read(&mut self) -> Result<Lines, SourceError> {
        let mut bytes = [0; 4096];
        let count = match self.kind.read(&mut bytes) {
            Ok(0) => return Ok(self.last()),
            Ok(count) => count,
            Err(error) if is_silence(&error) => 0,
            Err(error) => return Err(self.broken(error)),
        };
        let lines = bytes.iter().take(count).filter_map(|byte| self.splitter.feed(*byte));
        Ok(Lines::Some(lines.collect()))
    }

    /// Returns the last line of a log that ends without a line end.
    fn last(&mut self) -> Lines {
        self.splitter.feed(b'\n').map_or(Lines::End, |line| Lines::Some(vec![line]))
    }

    fn say(&mut self, text: &str) -> io::Result<()> {
        match &mut self.kind {
            Kind::Line(line) => line.write_all(text.as_bytes()),
            Kind::Log(_) => Ok(()),
        }
    }

    fn broken(&self, source: io::Error) -> SourceError {
        SourceError::Read { name: self.name.clone(), source }
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        // Close the adapter, as it was found. An error means that the adapter is unavailable, so it is ignored.
        let _ = self.say("C\r");
    }
}

impl Read for Kind {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Line(line) => line.read(bytes),
            Self::Log(file) => file.read(bytes),
        }
    }
}
