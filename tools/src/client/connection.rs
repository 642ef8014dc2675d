//! A serial line, or a TCP connection in its place: the emulator's, or a serial server's.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Longest wait for a connection, and for what is written to be taken.
const CONNECT: Duration = Duration::from_secs(5);

/// The error of a connection that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectError {
    /// The name is neither host:port nor a serial port that can be opened.
    #[error("{name}: not host:port, and not a serial port that can be opened: {source}")]
    Serial {
        /// The name as given.
        name: String,
        /// The system's error.
        source: serialport::Error,
    },
    /// The host does not accept the connection.
    #[error("{name}: cannot be connected: {source}")]
    Tcp {
        /// The name as given.
        name: String,
        /// The system's error.
        source: io::Error,
    },
    /// The CAN interface cannot be opened.
    #[error("can:{name}: {source}")]
    Interface {
        /// The name of the interface.
        name: String,
        /// The system's error.
        source: io::Error,
    },
    /// This system has no CAN interfaces.
    #[error("can:{name}: interfaces can be used on Linux alone")]
    NoInterfaces {
        /// The name as given.
        name: String,
    },
}

/// An open line. No read or write lasts longer than what it was opened with.
pub enum Connection {
    /// A port of this machine.
    Serial(Box<dyn serialport::SerialPort>),
    /// `host:port`.
    Tcp(TcpStream),
}

impl Connection {
    /// Opens `host:port`, or a serial port by its name at `baud`; a read waits for `wait` at most.
    ///
    /// # Errors
    /// [`ConnectError`].
    pub fn open(name: &str, baud: u32, wait: Duration) -> Result<Self, ConnectError> {
        if is_address(name) {
            let named = |source| ConnectError::Tcp { name: name.into(), source };
            return connect(name, wait).map(Self::Tcp).map_err(named);
        }
        let named = |source| ConnectError::Serial { name: name.into(), source };
        serialport::new(name, baud).timeout(wait).open().map(Self::Serial).map_err(named)
    }
}

/// `host:port`, but no device and no drive letter.
fn is_address(name: &str) -> bool {
    let address = |(host, port): (&str, &str)| !host.is_empty() && port.parse::<u16>().is_ok();
    name.rsplit_once(':').is_some_and(address)
}

fn connect(name: &str, wait: Duration) -> io::Result<TcpStream> {
    let mut last = io::Error::from(ErrorKind::AddrNotAvailable);
    for address in name.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => {
                stream.set_read_timeout(Some(wait))?;
                stream.set_write_timeout(Some(CONNECT))?;
                // Questions are short, and the answer is waited for.
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Returns whether a read has only timed out.
#[must_use]
pub fn is_silence(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

impl Read for Connection {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Serial(port) => port.read(bytes),
            Self::Tcp(stream) => stream.read(bytes),
        }
    }
}

impl Write for Connection {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Serial(port) => port.write(bytes),
            Self::Tcp(stream) => stream.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Serial(port) => port.flush(),
            Self::Tcp(stream) => stream.flush(),
        }
    }
}
