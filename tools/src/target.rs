//! The firmware's cost on its processor. [`mod@bench`] counts instructions and models cycles of the networks and
//! parsers in QEMU. [`size`] and [`stack`] read the image's ELF file.

pub mod bench;
pub mod size;
pub mod stack;
