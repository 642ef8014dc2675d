//! The background check compares the weights in use with their checksum, a piece at a time, because flash can lose
//! bits.

use super::blob::{BlobError, CRC};
use super::file::CrcTable;

/// Checks the weights over and over, one bounded piece at a time.
pub struct BackgroundCheck<'w> {
    content: &'w [u8],
    stored: u32,
    digest: crc::Digest<'static, u32, CrcTable>,
    at: usize,
}

impl<'w> BackgroundCheck<'w> {
    /// Creates a check from the first byte of a file's content; `crc` is its checksum when it was loaded.
    pub fn new(content: &'w [u8], crc: u32) -> Self {
        Self { content, stored: crc, digest: CRC.digest(), at: 0 }
    }

    pub fn len(&self) -> usize {
        self.content.len()
    }

    /// Returns whether there is nothing to check; weights are never empty.
    pub fn is_empty(&self) -> bool {
        self.content.is_empty()
    }

    /// Checks up to `count` more bytes; with the last ones it returns the result of the round and begins the next.
    pub fn advance(&mut self, count: usize) -> Option<Result<(), BlobError>> {
        let end = self.at.saturating_add(count).min(self.content.len());
        self.digest.update(self.content.get(self.at..end).unwrap_or_default());
        self.at = end;
        if end < self.content.len() {
            return None;
        }
        self.at = 0;
        let computed = core::mem::replace(&mut self.digest, CRC.digest()).finalize();
        let stored = self.stored;
        Some(if computed == stored { Ok(()) } else { Err(BlobError::Crc { computed, stored }) })
    }
}
