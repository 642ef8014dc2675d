//! Each purpose in a simulation has its own stream of random numbers, so that changing one stream does not change the
//! others.

use crate::random::Random;

#[derive(Debug, Clone, Copy)]
pub enum Purpose {
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
    DeviceWarming,
    Warming,
    Gnss,
}

impl Purpose {
    pub fn stream(self, seed: u64) -> Random {
        Random::new(seed, self as u64)
    }
}
