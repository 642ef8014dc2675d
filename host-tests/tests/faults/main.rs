//! Small parts of the fault harness's runs; `cargo run -p gyronet-host-tests --bin faults` makes the long ones.

mod campaign;
mod soak;
