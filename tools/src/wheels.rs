//! The wheel speeds of a vehicle's bus as a file that a person reads and edits, and where it comes from: a DBC file and
//! the names of the signals.
//!
//! The board keeps the same settings as a record ([`gyronet::can::wheel::WheelSettings`]), so that another vehicle needs
//! no new image. Both ways go through the library's own check.

mod dbc;
mod file;

pub use dbc::{DbcError, Signals, from_dbc};
pub use file::{WheelFile, WheelFileError};
