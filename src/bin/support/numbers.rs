//! Reproducible numbers, shared by the images.

/// A pseudo-random generator (xorshift32) for numbers that only need to vary.
#[derive(Clone, Copy)]
pub struct Numbers(u32);

impl Numbers {
    /// Returns a generator with a seed, which must not be zero.
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }

    pub const fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    pub const fn within(&mut self, limit: i32) -> i32 {
        (self.next() >> 1) as i32 % (2 * limit + 1) - limit
    }
}
