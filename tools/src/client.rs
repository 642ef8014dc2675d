//! Clients of a board: [`device`] asks and configures it over its service line, [`monitor`] checks its CAN messages
//! as a receiver would. Both reach it through a [`connection`].

pub mod connection;
pub mod device;
pub mod monitor;
