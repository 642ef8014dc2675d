//! Sensors on the wire: bytes in, samples out. No input or output of its own.

pub mod framer;
pub mod xsens;
