//! Drives from other people's logs: the formats read one file each as timed measurements, [`drive`] puts
//! those that were chosen on the 100 Hz grid and writes the CSV that every other command reads.
//!
//! A log is read once, from front to back, with one record in memory at a time; what stays is the samples of the
//! channels that a drive can need, of plain numbers only those that are named, up to [`log::MAX_SAMPLES`] of each, in
//! temporary files where they are many. A record that cannot be used is counted with the reason, and reading goes on
//! behind it where the format allows that.

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
