//! The streams of random numbers of a simulation: each purpose has one of its own.

use crate::random::Random;

/// The purpose of a stream.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    Route,
    Road,
    Wheels,
    Vibration,
    Mems,
    Device,
    Fog,
    Odometer,
    Stamps,
    Magnetometer,
}

impl Purpose {
    /// Starts the stream of this purpose.
    pub fn stream(self, seed: u64) -> Random {
        Random::new(seed, self as u64)
    }
}
