//! The client of a board: [`device`] queries and configures it over diagnosis on a [`bus`]. A [`connection`] is a serial
//! line or a socket.

pub mod bus;
pub mod connection;
pub mod device;
