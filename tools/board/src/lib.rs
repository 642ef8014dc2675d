//! The product on the virtual board: the process with its model, the image, what both need of this machine, bytes of its
//! lines, and the command that drives it.

pub mod board;
pub mod command;
pub mod image;
pub mod recordings;
pub mod require;
pub mod wire;
