//! Tests of the firmware images in QEMU: the bytes that they send, their size and what they cost.

mod deadlines;
mod firmware;
mod firmware_demo;
mod firmware_faults;
mod firmware_fog;
mod firmware_fog_faults;
mod firmware_service;
mod firmware_slcan;
mod firmware_soak;
mod firmware_stored;
mod image_size;
mod monitor;
mod python_clients;
mod small_cores;
mod target_counts;
mod uds_slcan;
