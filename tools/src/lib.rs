//! gyronet on a host: read recordings, quantise, replay, evaluate, simulate.

pub mod checkpoint;
pub mod quantize;
