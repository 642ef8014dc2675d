//! UDS (ISO 14229) over ISO-TP (ISO 15765-2): the diagnosis that a workshop's tools speak.
//!
//! [`Server`] takes the data of frames to its identifier (0x7E0 unless configured) or to all (0x7DF) and has frames to
//! send (0x7E8); what it reads and writes is the [`crate::service::Device`]. A tester of the shelf works: udsoncan and
//! can-isotp do so in the tests.
//!
//! | service | session | what |
//! |---|---|---|
//! | 0x10 | any | sessions 1, 2, 3; back to 1 after 5 s of silence |
//! | 0x11 | any | restart (1, 3), at standstill |
//! | 0x14, 0x19 | any | troubles: clear; count (01), list (02, 0A), state when it came (04), occurrences (06) |
//! | 0x22 | any | [data by identifier](data) |
//! | 0x28 | 2, 3 | stop (1) and continue (0) the messages of the board, at standstill |
//! | 0x2E | 2, 3 | the same, where they can be written, at standstill |
//! | 0x31 | 2, 3 | 0200 static, 0201 mounting calibration; 0202 stores it; FF01 (session 2) uses the download |
//! | 0x34, 0x36, 0x37 | 2 | download of a weight file to address 0 |
//! | 0x3E | any | tester present |
//! | 0x85 | 2, 3 | stop and continue the memory of troubles |

pub mod data;
mod download;
pub mod dtc;
pub mod isotp;
mod response;
mod server;

pub use response::Nrc;
pub use server::{Server, Session};

use embedded_can::{Id, StandardId};

/// Identifier of requests to this server.
pub const REQUEST: u16 = 0x7E0;
/// Identifier of requests to all servers.
pub const FUNCTIONAL: u16 = 0x7DF;
/// Identifier of this server's frames.
pub const RESPONSE: u16 = 0x7E8;

/// The servers that a request is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// This one.
    Server,
    /// All on the bus.
    All,
}

/// Returns whom a frame is for; `None` where it is no request.
#[must_use]
pub fn target(id: Id) -> Option<Target> {
    match id {
        Id::Standard(id) if id.as_raw() == REQUEST => Some(Target::Server),
        Id::Standard(id) if id.as_raw() == FUNCTIONAL => Some(Target::All),
        Id::Standard(_) | Id::Extended(_) => None,
    }
}

/// Returns the identifiers of requests.
pub fn request_ids() -> impl Iterator<Item = Id> {
    [REQUEST, FUNCTIONAL].into_iter().filter_map(StandardId::new).map(Id::Standard)
}

/// Returns the identifier of this server's frames.
#[must_use]
pub const fn response_id() -> StandardId {
    match StandardId::new(RESPONSE) {
        Some(id) => id,
        None => StandardId::MAX,
    }
}
