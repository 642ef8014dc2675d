//! The angle by which a rate turns to and fro: of an engine that shakes a standing vehicle, whose rate is sent as zero, or of
//! what a network takes off, which may be such a shake.

use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;

const STEP: f32 = 1.0 / RATE_HZ as f32;
/// Share of the angle that a sample forgets: the vehicle swings about a mean of a quarter of a second.
const FORGETS: f32 = 4.0 * STEP;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Swing {
    angle: f32,
    mean: f32,
    pub variance: f32,
    /// The seconds over which it is averaged so far, and at most: a vibration is now more, now less.
    seconds: f32,
    longest: f32,
}

impl Swing {
    /// The state before the first sample, averaged over these seconds.
    pub const fn over(longest: f32) -> Self {
        Self { angle: 0.0, mean: 0.0, variance: 0.0, seconds: 0.0, longest }
    }

    /// The variance of the angle from the newest sample to one a second ago, rad^2: the newest is known.
    pub fn ends(&self) -> f32 {
        let off = self.angle - self.mean;
        self.variance + off * off
    }

    /// The largest angle between two samples, but for one in twenty, rad.
    pub fn angle(&self) -> f32 {
        2.0 * sqrt(2.0 * self.variance)
    }

    pub fn add(&mut self, turn: f32) {
        if self.seconds == 0.0 {
            // As if it had always been so: a steady rate is no swing.
            self.angle = turn / FORGETS;
            self.mean = self.angle;
        }
        self.angle += turn - FORGETS * self.angle;
        self.seconds = (self.seconds + STEP).min(self.longest);
        let (part, off) = (STEP / self.seconds, self.angle - self.mean);
        self.mean += part * off;
        self.variance += part * (off * off - self.variance);
    }
}
