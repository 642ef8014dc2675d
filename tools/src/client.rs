//! Clients of a board: [`device`] queries and configures a board over diagnosis on a [`bus`], and [`monitor`] checks
//! the board's CAN messages as a receiver would. A [`connection`] is a serial line or a socket.

pub mod bus;
pub mod connection;
pub mod device;
pub mod monitor;
