//! The turn at standstill by the newest samples, in quarters of a second, before a whole second is complete.

use crate::sample::RATE_HZ;
use crate::units::AngularRate;

const SHIFT: u32 = AngularRate::FRACTION_BITS - 20;
const PER_RAD: f32 = (AngularRate::PER_RAD_PER_SEC / (1 << SHIFT) as f32) * RATE_HZ as f32;
const QUARTER: u8 = RATE_HZ as u8 / 4;

#[derive(Debug, Clone, Copy)]
pub(super) struct Turned {
    /// 2^-20 rad/s x samples: in the current quarter, and in the four before it. Any second that ends now lies within.
    sums: [i32; 5],
    /// Samples in the current quarter, and in the one before it.
    samples: [u8; 2],
}

impl Turned {
    pub const NONE: Self = Self { sums: [0; 5], samples: [0; 2] };

    /// Adds a rate, less the bias; a sum of 125 of them fits.
    pub fn add(&mut self, code: i32) {
        let [current, _] = self.samples;
        if current == QUARTER {
            self.sums.rotate_right(1);
            (self.sums[0], self.samples) = (0, [0, QUARTER]);
        }
        self.sums[0] += code >> SHIFT;
        self.samples[0] += 1;
    }

    pub fn angle(&self) -> f32 {
        self.sums.iter().sum::<i32>() as f32 / PER_RAD
    }

    /// The rate of the newest two quarters beyond a noise of their angle, rad/s.
    pub fn newest_rate(&self, noise: f32) -> f32 {
        let ([one, two, ..], [current, before]) = (self.sums, self.samples);
        let seconds = f32::from(current + before) / RATE_HZ as f32;
        let angle = libm::fabsf((one + two) as f32 / PER_RAD);
        (angle - noise).max(0.0) / seconds.max(0.25)
    }
}
