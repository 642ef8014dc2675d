//! A Linux CAN interface (SocketCAN), which the kernel shares among programs.

use super::{Bus, WAIT};
use crate::client::connection::ConnectError;
use embedded_can::Frame;
use gyronet::can::DataFrame;
use socketcan::{CanFrame, CanSocket, Socket, SocketOptions};
use std::io::{ErrorKind, Result};

pub struct Interface(CanSocket);

impl Interface {
    pub fn open(name: &str) -> std::result::Result<Self, ConnectError> {
        let open = || {
            let socket = CanSocket::open(name)?;
            socket.set_read_timeout(WAIT)?;
            socket.set_error_filter_drop_all()?;
            Ok(Self(socket))
        };
        open().map_err(|source| ConnectError::Interface { name: name.to_owned(), source })
    }
}

impl Bus for Interface {
    fn send(&mut self, frame: &DataFrame) -> Result<()> {
        let frame = CanFrame::new(frame.id(), frame.data()).ok_or(ErrorKind::InvalidInput)?;
        self.0.write_frame(&frame)
    }

    fn receive(&mut self) -> Result<Vec<DataFrame>> {
        match self.0.read_frame() {
            Ok(frame) => Ok(DataFrame::new(frame.id(), frame.data()).into_iter().collect()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interface_that_does_not_exist_is_named() {
        let Err(error) = Interface::open("nosuch0") else { panic!("there is no such interface") };
        assert!(error.to_string().starts_with("can:nosuch0: "), "{error}");
    }
}
