//! These modules handle recorded drives: [`recording`] reads one, [`wheel_frames`] turns its wheels into the frames of
//! a vehicle's bus, [`vehicle`] is the file beside it that says what is known of the vehicle, [`replay`] runs it through the coprocessor as the board would, [`candump`] writes what was
//! sent, [`foxglove`] writes everything for Foxglove, and [`export`] writes tables and paths.

pub mod candump;
pub mod error;
pub mod export;
#[cfg(feature = "logs")]
pub mod foxglove;
pub mod recording;
pub mod replay;
pub mod vehicle;
pub mod wheel_frames;

use gyronet::sample::RATE_HZ;

/// One sample on the grid takes this time, s.
pub const DT: f64 = 1.0 / RATE_HZ as f64;
