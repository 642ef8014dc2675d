//! The vehicle bus: message layouts, their checks, and ways to carry them.

pub mod bosch;
pub mod carry;
pub mod config;
pub mod e2e;
pub mod encoder;
pub mod fog_encoder;
pub mod frame;
pub mod j1939;
pub mod load;
pub mod queue;
pub mod signal;
pub mod slcan;
pub mod wheel;
pub mod yaw;
pub mod yaw_encoder;

pub use frame::DataFrame;
