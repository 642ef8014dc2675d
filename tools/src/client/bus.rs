//! A bus carries CAN frames between this computer and a board. It is an SLCAN line or a CAN interface of Linux.

mod slcan;
#[cfg(target_os = "linux")]
mod socketcan;

use super::connection::ConnectError;
use gyronet::can::DataFrame;
use std::io::Result;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

pub use slcan::{Line, SlcanBus};

/// The longest time for which [`Bus::receive`] waits for a frame.
pub const WAIT: Duration = Duration::from_millis(20);
/// Prefix of the name of a Linux CAN interface.
const INTERFACE: &str = "can:";

pub trait Bus {
    fn send(&mut self, frame: &DataFrame) -> Result<()>;

    /// Returns the received frames; if there are none, waits for at most [`WAIT`].
    fn receive(&mut self) -> Result<Vec<DataFrame>>;

    /// Returns the time since an arbitrary but fixed moment.
    fn now(&mut self) -> Duration {
        computer_time()
    }
}

/// Returns the time since the first call.
fn computer_time() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
}

impl<B: Bus + ?Sized> Bus for Box<B> {
    fn send(&mut self, frame: &DataFrame) -> Result<()> {
        (**self).send(frame)
    }

    fn receive(&mut self) -> Result<Vec<DataFrame>> {
        (**self).receive()
    }

    fn now(&mut self) -> Duration {
        (**self).now()
    }
}

/// Opens a Linux CAN interface (`can:can0`) or an SLCAN line (`host:port`, or a serial port at `baud`).
pub fn open(name: &str, baud: u32) -> std::result::Result<Box<dyn Bus>, ConnectError> {
    match name.strip_prefix(INTERFACE) {
        #[cfg(target_os = "linux")]
        Some(interface) => Ok(Box::new(socketcan::Interface::open(interface)?)),
        #[cfg(not(target_os = "linux"))]
        Some(interface) => Err(ConnectError::NoInterfaces { name: interface.to_owned() }),
        None => Ok(Box::new(SlcanBus::open(name, baud)?)),
    }
}
