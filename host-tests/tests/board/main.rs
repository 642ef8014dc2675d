//! The images as they are flashed, on the virtual board: hardware that QEMU does not have, and its faults.

mod access;
mod bringup;
mod can;
mod clock;
mod common;
mod crash;
mod embassy;
mod endurance;
mod icm42688;
mod model;
mod power_cut;
mod service;
mod stored;
mod supply;
mod uds;
mod wheels;
