//! The images as they are flashed, on the virtual board: their frames, their hardware and its faults.

mod access;
mod bringup;
mod budget;
mod can;
mod clock;
mod common;
mod crash;
mod endurance;
mod gnss;
mod minimal;
mod model;
mod nucleo;
mod nucleo_fd;
mod nucleo_update;
mod power_cut;
mod service;
mod slcan;
mod sockets;
mod spi_sensors;
mod stored;
mod stored_start;
mod supply;
mod timing;
mod uds;
mod update;
mod wheels;
