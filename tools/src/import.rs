//! These modules import drives from logs of other programs. The format modules read one file each as timed
//! measurements. [`drive`] resamples the chosen channels to the 100 Hz grid and writes the CSV that every other
//! command reads.
//!
//! A log is read once, from front to back, with one record in memory at a time. Only samples that a drive can need
//! are kept: of plain numbers the named channels, and at most [`log::MAX_SAMPLES`] of each channel. Many samples are
//! kept in temporary files. A record that cannot be used is counted with the reason; reading continues with the next
//! record if the format allows it.

pub(crate) mod align;
mod blf;
pub mod can;
mod candump;
mod course;
pub mod drive;
pub mod error;
mod format;
mod grid;
mod input;
pub mod log;
mod mcap;
mod ros_bag;
mod ros_message;
pub mod samples;
mod select;
mod table;
mod ulog;
pub mod value;
mod zstd;

pub use format::{read_bytes, read_file};
