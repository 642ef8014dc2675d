//! The key of those who may write is a stored record, with what must never go back.

use super::error::FieldError;
use super::record::Record;
use serde::{Deserialize, Serialize};

/// Bytes of an Ed25519 public key.
pub const KEY: usize = 32;

/// Holds the key, and what stands against replayed and guessed answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Access {
    /// The public key; without one everyone may write.
    pub key: Option<[u8; KEY]>,
    /// The counter of the newest signature that was accepted; older ones are refused.
    pub counter: u32,
    /// Wrong answers in a row to a challenge.
    pub wrong: u8,
}

impl Access {
    /// No key was stored.
    pub const OPEN: Self = Self { key: None, counter: 0, wrong: 0 };
}

impl Record for Access {
    const KEY: u8 = 6;
    const VERSION: u8 = 1;

    /// A key that is no point of the curve verifies nothing.
    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}
