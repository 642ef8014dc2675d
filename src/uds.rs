//! UDS (ISO 14229) over ISO-TP (ISO 15765-2): the diagnosis that a workshop's tools speak.
//!
//! [`Server`] accepts the data of frames to its own identifier or to all, and returns frames to send
//! ([`crate::can::diagnosis`]). It reads and writes the [`crate::service::Device`]. Off-the-shelf testers work: the
//! tests use udsoncan and can-isotp.
//!
//! | service | session | what |
//! |---|---|---|
//! | 0x10 | any | sessions 1, 2, 3; back to 1 after 5 s of silence |
//! | 0x11 | any | restart (1, 3), at standstill |
//! | 0x14, 0x19 | any | troubles: clear; count (01), list (02, 0A), snapshot (04), occurrences (06) |
//! | 0x22 | any | data by identifier (`gyronet reference identifiers`) |
//! | 0x27 | 2, 3 | [access](security) by challenge (1) and response (2), where a key is stored |
//! | 0x28 | 2, 3 | stop (1) and continue (0) the messages of the board, at standstill |
//! | 0x2E | 2, 3 | write data by identifier where permitted, at standstill |
//! | 0x31 | 2, 3 | 0204 tests the board: a bit for each part that fails, see the YAML |
//! | 0x31 | 2 | FF01 uses the download |
//! | 0x34, 0x36, 0x37 | 2 | download of a weight file to address 0, of [firmware](update) to address 2 |
//! | 0x3E | any | tester present |
//! | 0x85 | 2, 3 | stop and continue the recording of troubles |

mod control;
mod data;
mod download;
#[doc(hidden)]
pub mod dtc;
mod exchange;
#[doc(hidden)]
pub mod isotp;
mod lock;
mod response;
mod routines;
#[doc(hidden)]
pub mod security;
mod server;
mod services;
mod session;
#[doc(hidden)]
pub mod signature;
mod troubles;
#[doc(hidden)]
pub mod update;

pub use response::Nrc;
pub use server::Server;
pub use session::Session;
