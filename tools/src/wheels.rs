//! These modules read and write a text file that describes the wheel frames of a vehicle's bus, and create such a
//! file from a DBC file and the names of the signals.
//!
//! The board stores the same settings as a record ([`gyronet::can::wheel::WheelSettings`]), so that another vehicle
//! needs no new image. Both are checked by the library.

#[cfg(feature = "logs")]
pub(crate) mod dbc;
mod file;

#[cfg(feature = "logs")]
pub use dbc::{DbcError, Signals, from_dbc};
pub use file::{WheelFile, WheelFileError};
