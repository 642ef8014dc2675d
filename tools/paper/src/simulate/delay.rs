//! Delays messages, because the stamps in a data set are the logger's, not the sensor's.

use crate::simulate::vehicles::Delays;
use gyronet_tools::random::Random;
use gyronet_tools::simulate::purpose::Purpose;

/// Delays the messages of one part.
#[derive(Debug, Clone)]
pub(super) struct Delay {
    delays: Delays,
    random: Random,
    last: f64,
    /// Begin and end of the current or next blockage, s.
    blocked: [f64; 2],
}

/// Shortest time between two messages of a part, s, because reading one takes as long.
const APART: f64 = 10e-6;

impl Delay {
    pub fn new(delays: Delays, run: u64, stream: u64) -> Self {
        let random = Purpose::Stamps.stream(run ^ (stream << 48));
        let mut delay = Self { delays, random, last: f64::NEG_INFINITY, blocked: [0.0; 2] };
        delay.block();
        delay
    }

    /// Returns the arrival time of a message, s, later than that of the previous message; `time` is when it is sent.
    pub fn arrival(&mut self, time: f64) -> f64 {
        while time > self.blocked[1] {
            self.block();
        }
        let [from, to] = self.blocked;
        let released = if time >= from { to } else { time };
        let arrival = (released + self.random.exponential(self.delays.mean)).max(self.last + APART);
        self.last = arrival;
        arrival
    }

    fn block(&mut self) {
        let [between, length] = self.delays.blockage;
        if !between.is_finite() {
            self.blocked = [f64::INFINITY; 2];
            return;
        }
        let from = self.blocked[1] + self.random.exponential(between);
        self.blocked = [from, from + self.random.exponential(length).min(self.delays.longest)];
    }
}
