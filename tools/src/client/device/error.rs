//! The errors of a request to a board.

use crate::client::connection::ConnectError;
use gyronet::service::message::Refusal;
use gyronet::uds::Nrc;
use std::fmt;

/// The error of a request without the expected response.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The line cannot be opened.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The line cannot be used.
    #[error("{name}: {source}")]
    Line {
        /// Its name.
        name: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// The identifiers are no three of the same kind.
    #[error("identifier {0:#x}: has too many bits, or is there twice")]
    Identifier(u32),
    /// No response came.
    #[error("{name}: no response to three requests; is this the board's line, and is the board running?")]
    Silence {
        /// The line.
        name: String,
    },
    /// The board refused the request, for this reason.
    #[error("the board refuses: {0}")]
    Refused(Refusal),
    /// The board refused the request, and has a code for it alone.
    #[error("the board refuses service {service:#04x}: {code}")]
    Negative {
        /// The service.
        service: u8,
        /// The negative response code (ISO 14229-1 A.1).
        code: Code,
    },
    /// The response is not one that this program knows.
    #[error("the response is not one of this version ({} of gyronet); is the board's firmware another one?", env!("CARGO_PKG_VERSION"))]
    Mismatch,
    /// A request that is longer than the board takes.
    #[error("the request is too long for the board")]
    TooLong,
}

/// A negative response code, with its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Code(pub u8);

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Nrc::from_repr(self.0) {
            Some(name) => write!(f, "{name:?} ({:#04x})", self.0),
            None => write!(f, "code {:#04x}", self.0),
        }
    }
}
