//! A connection is a serial line, or a TCP socket in its place, as the emulator and serial servers have.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

const CONNECT: Duration = Duration::from_secs(5);

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectError {
    #[error("{name}: neither a file, host:port, nor a serial port that can be opened: {source}")]
    Serial { name: String, source: serialport::Error },
    #[error("{name}: cannot connect: {source}")]
    Tcp { name: String, source: io::Error },
    #[error("can:{name}: {source}")]
    Interface { name: String, source: io::Error },
    #[error("can:{name}: CAN interfaces work only on Linux")]
    NoInterfaces { name: String },
}

pub trait Stream: Read + Write {}

impl<S: Read + Write> Stream for S {}

pub type Connection = Box<dyn Stream>;

/// Opens `host:port`, or a serial port by its name at `baud`; a read waits for at most `wait`.
pub fn open(name: &str, baud: u32, wait: Duration) -> Result<Connection, ConnectError> {
    let name = name.to_owned();
    if is_address(&name) {
        return match connect(&name, wait) {
            Ok(stream) => Ok(Box::new(stream)),
            Err(source) => Err(ConnectError::Tcp { name, source }),
        };
    }
    match serialport::new(&name, baud).timeout(wait).open() {
        Ok(port) => Ok(Box::new(port)),
        Err(source) => Err(ConnectError::Serial { name, source }),
    }
}

/// Returns whether a name is `host:port`, and not a device or a path with a drive letter.
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
                // Requests are short, and the sender waits for each response.
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Returns whether an error of a read only means that no bytes arrived in time.
pub fn is_silence(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
