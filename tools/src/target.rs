//! The firmware's cost on its processor. [`mod@bench`] counts instructions and models cycles of the networks
//! in QEMU, [`cmsis_nn`] those of the same network by CMSIS-NN. [`size`] and [`stack`] read the image's ELF
//! file; [`firmware`] makes of it what a board gets.

pub mod bench;
pub mod cmsis_nn;
pub mod firmware;
pub mod size;
pub mod stack;
