//! The service line over a serial port or a TCP connection.

use super::DeviceError;
use crate::client::connection::Connection;
use std::io::{Read, Result, Write};
use std::time::Duration;

const BAUD: u32 = 115_200;
/// The longest time that a read waits for bytes.
const WAIT: Duration = Duration::from_millis(50);

/// An open one.
pub struct Line(Connection);

impl Line {
    /// Opens `host:port`, or a serial port by its name.
    ///
    /// # Errors
    /// [`DeviceError::Connect`].
    pub fn open(port: &str) -> std::result::Result<Self, DeviceError> {
        Ok(Self(Connection::open(port, BAUD, WAIT)?))
    }
}

impl Read for Line {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.0.flush()
    }
}
