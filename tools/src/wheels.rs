//! These modules describe the wheel frames of a vehicle's bus in a file that a person reads and edits, and make that
//! file from a DBC file and the names of the signals.
//!
//! The board keeps the same settings as a record ([`gyronet::can::wheel::WheelSettings`]), so that another vehicle
//! needs no new image. Both pass the library's own check.

#[cfg(feature = "logs")]
pub(crate) mod dbc;
mod file;

#[cfg(feature = "logs")]
pub use dbc::{DbcError, Signals, from_dbc};
pub use file::{WheelFile, WheelFileError};
