//! Tests of the firmware images: their size, and what the kernels cost in QEMU.

mod c_interface;
mod image_size;
mod small_cores;
mod target_counts;
