//! Delays messages, because the stamps in a data set are the logger's, not the sensor's.

use gyronet_tools::random::Random;
use gyronet_tools::simulate::purpose::Purpose;

#[derive(Debug, Clone)]
pub(super) struct Delay {
    random: Random,
    last: f64,
}

/// Mean delay of a stamp, s.
const MEAN: f64 = 1e-4;
/// Shortest time between two messages of a part, s, because reading one takes as long.
const APART: f64 = 10e-6;

impl Delay {
    pub fn new(run: u64, stream: u64) -> Self {
        Self { random: Purpose::Stamps.stream(run ^ (stream << 48)), last: f64::NEG_INFINITY }
    }

    /// Returns the arrival time of a message, s, later than that of the previous message; `time` is when it is sent.
    pub fn arrival(&mut self, time: f64) -> f64 {
        let arrival = (time + self.random.exponential(MEAN)).max(self.last + APART);
        self.last = arrival;
        arrival
    }
}
