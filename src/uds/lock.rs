//! What a session has proved: the challenge that waits for its answer, and whether the answer was right.

use super::signature::SEED;

/// A random challenge.
pub type Seed = [u8; SEED];

#[derive(Debug)]
pub(super) struct Lock {
    is_open: bool,
    seed: Option<Seed>,
    /// Newest challenge; a repeated challenge shows that the random numbers have failed.
    newest: Seed,
    /// Time of the last wrong answer, or of the start, ms.
    wrong_at: u32,
}

impl Lock {
    pub const fn new() -> Self {
        Self { is_open: false, seed: None, newest: [0; SEED], wrong_at: 0 }
    }

    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Keeps a new challenge; `None` if there is none or it repeats the one before.
    pub fn challenge(&mut self, new: Option<Seed>) -> Option<Seed> {
        let seed = new.filter(|seed| *seed != self.newest)?;
        (self.seed, self.newest) = (Some(seed), seed);
        Some(seed)
    }

    /// Takes the challenge that is answered now; it is answered once.
    pub fn answered(&mut self) -> Option<Seed> {
        self.seed.take()
    }

    pub fn open(&mut self) {
        self.is_open = true;
    }

    pub fn was_wrong(&mut self, now: u32) {
        self.wrong_at = now;
    }

    /// Returns the time since the last wrong answer, ms.
    pub fn since_wrong(&self, now: u32) -> u32 {
        now.wrapping_sub(self.wrong_at)
    }

    /// The session ends: what it has proved holds no longer.
    pub fn end(&mut self) {
        (self.is_open, self.seed) = (false, None);
    }
}
