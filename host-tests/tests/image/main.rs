//! Tests of the firmware images: their size, and what the kernels cost in QEMU; and of the programs that read a board.

mod c_interface;
mod image_size;
mod monitor;
mod small_cores;
mod target_counts;
