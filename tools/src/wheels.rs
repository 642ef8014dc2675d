//! These modules read and write a text file that describes the wheel frames of a vehicle's bus. The package `gyronet`
//! in Python makes one of a DBC file.
//!
//! The board stores the same settings as a record ([`gyronet::can::wheel::WheelSettings`]), so that another vehicle
//! needs no new image. Both are checked by the library.

mod file;

pub use file::{WheelFile, WheelFileError};
