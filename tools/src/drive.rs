//! Recorded drives. [`stream`] reads a drive row by row, [`recording`] keeps one in memory, [`vehicle`] reads the
//! vehicle file beside it, and [`wheel_frames`] turns wheel speeds into CAN frames. [`replay`] runs the drive through
//! the board. [`track`] is its path. [`candump`] writes the frames that were sent, [`export`] tables and
//! paths.

pub mod candump;
pub mod error;
pub mod export;
pub(crate) mod foreign;
pub mod recording;
pub mod replay;
pub mod stream;
pub mod track;
pub mod vehicle;
pub mod wheel_frames;

use gyronet::sample::RATE_HZ;

/// Sample period of the grid, s.
pub const DT: f64 = 1.0 / RATE_HZ as f64;
