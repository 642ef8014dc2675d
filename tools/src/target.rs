//! These modules measure the firmware's cost on its processor. [`emulator`] runs an image in QEMU. [`mod@bench`]
//! counts instructions and models cycles of the networks and parsers; [`tasks`] does so for every interrupt handler,
//! and [`schedule`] computes worst-case response times from that. [`size`] and [`stack`] read the image's ELF file.

pub mod bench;
pub mod emulator;
pub mod largest_model;
pub mod parser_load;
pub mod ram_flash;
pub mod schedule;
pub mod size;
pub mod stack;
pub mod tasks;
