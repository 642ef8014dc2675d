//! Each purpose in a simulation has a stream of random numbers of its own, so that a change of one leaves the others as
//! they are.

use crate::random::Random;

/// Names the purpose of a stream.
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
