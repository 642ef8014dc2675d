//! The vehicle bus: message layouts, their checks, and ways to carry them.

pub mod bosch;
pub mod e2e;
pub mod frame;
pub mod slcan;

pub use frame::DataFrame;
