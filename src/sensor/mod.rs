//! Sensors on the wire: bytes in, samples out. No input or output of its own.

pub mod adis16465;
pub mod crc;
pub mod dsp1760;
pub mod dsp3000;
pub mod framer;
pub mod icm42688;
pub mod xsens;
