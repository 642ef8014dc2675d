//! A serial line, or a TCP connection in its place: the emulator's, or a serial server's.

use super::DeviceError;
use std::io::{ErrorKind, Read, Result, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Of the service line.
const BAUD: u32 = 115_200;
/// How long a read waits for bytes.
const READ: Duration = Duration::from_millis(50);
/// How long a write and a connection may take.
const CONNECT: Duration = Duration::from_secs(5);

/// An open line.
pub enum Line {
    /// A port of this machine.
    Serial(Box<dyn serialport::SerialPort>),
    /// `host:port`.
    Tcp(TcpStream),
}

impl Line {
    /// Opens `host:port`, or a serial port by its name.
    ///
    /// # Errors
    /// [`DeviceError::Line`].
    pub fn open(port: &str) -> std::result::Result<Self, DeviceError> {
        let named = |source| DeviceError::Line { port: port.to_owned(), source };
        if port.rsplit_once(':').is_some_and(|(_, number)| number.parse::<u16>().is_ok()) {
            return tcp(port).map(Self::Tcp).map_err(named);
        }
        let serial = serialport::new(port, BAUD).timeout(READ).open();
        serial.map(Self::Serial).map_err(|error| named(error.into()))
    }
}

fn tcp(address: &str) -> Result<TcpStream> {
    let mut refused = ErrorKind::AddrNotAvailable.into();
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => {
                stream.set_read_timeout(Some(READ))?;
                stream.set_write_timeout(Some(CONNECT))?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

impl Read for Line {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        match self {
            Self::Serial(port) => port.read(bytes),
            Self::Tcp(stream) => stream.read(bytes),
        }
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        match self {
            Self::Serial(port) => port.write(bytes),
            Self::Tcp(stream) => stream.write(bytes),
        }
    }

    fn flush(&mut self) -> Result<()> {
        match self {
            Self::Serial(port) => port.flush(),
            Self::Tcp(stream) => stream.flush(),
        }
    }
}
