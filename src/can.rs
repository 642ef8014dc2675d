//! Encoding, decoding, queueing and transport of the messages on the vehicle's bus.

pub mod bosch;
pub mod bus_off;
pub mod config;
pub mod diagnosis;
#[doc(hidden)]
pub mod e2e;
#[doc(hidden)]
pub mod encoder;
pub mod fd;
#[doc(hidden)]
pub mod fog_encoder;
#[doc(hidden)]
pub mod identifier;
#[doc(hidden)]
pub mod load;
#[doc(hidden)]
pub mod queue;
mod settings;
#[doc(hidden)]
pub mod signal;
pub mod slcan;
pub mod status;
pub mod wheel;
pub mod yaw;
#[doc(hidden)]
pub mod yaw_encoder;

pub use queue::DataFrame;
