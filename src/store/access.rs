//! The access record holds the key that authorises writing, and the counters that a restart must not reset.

use super::record::Record;
use serde::{Deserialize, Serialize};

/// Length of an Ed25519 public key, bytes.
pub const KEY: usize = 32;

/// The key, and the counters against replayed signatures and guessed answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Access {
    /// Public key; without one, everyone may write.
    pub key: Option<[u8; KEY]>,
    /// Counter of the newest accepted signature; signatures whose counter is not greater are refused.
    pub counter: u32,
    /// Number of successive wrong answers to a challenge.
    pub wrong: u8,
}

impl Access {
    /// Record without a key.
    pub const OPEN: Self = Self { key: None, counter: 0, wrong: 0 };
}

// Any key is accepted: with one that is not a point of the curve, no signature is valid.
impl Record for Access {
    const KEY: u8 = 6;
    const VERSION: u8 = 1;
}
