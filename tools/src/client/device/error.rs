//! Defines the errors of a request to a board.

use crate::client::connection::ConnectError;
use gyronet::service::message::Refusal;
use gyronet::uds::Nrc;
use std::fmt;

#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    #[error(transparent)]
    Connect(#[from] ConnectError),
    #[error("{name}: {source}")]
    Line { name: String, source: std::io::Error },
    #[error("identifier {0:#x}: has too many bits, or is given twice")]
    Identifier(u32),
    #[error("{name}: no response to three requests; is this the board's line, and is the board running?")]
    Silence { name: String },
    #[error("the board refuses: {0}")]
    Refused(Refusal),
    #[error("the board refuses service {service:#04x}: {code}")]
    Negative {
        service: u8,
        /// The negative response code (ISO 14229-1 A.1).
        code: Code,
    },
    #[error("the response does not fit this version ({} of gyronet); does the board have another firmware version?", env!("CARGO_PKG_VERSION"))]
    Mismatch,
    #[error("the request is too long for the board")]
    TooLong,
}

/// A negative response code, which prints with its name.
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
