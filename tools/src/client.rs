//! Clients of a board: [`device`] asks and configures it over diagnosis on a [`bus`], [`monitor`] checks its CAN messages
//! as a receiver would. A serial line or a socket is a [`connection`].

pub mod bus;
pub mod connection;
pub mod device;
pub mod monitor;
