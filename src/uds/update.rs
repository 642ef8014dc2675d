//! The head of a firmware update (data 011A): what its images are, and their hashes. It is what is signed.
//!
//! A tester writes the head before it sends an image, so everything is refused before anything is erased. The counter of
//! its signature is used up when the image is activated: an update that was interrupted can be repeated.

use super::signature::{DIGEST, Digest};
use crate::store::firmware::{LABEL_SIZE, Label};

/// Size of the head of an update, bytes: a label, 1 if an older version is wanted, length (high byte first) and SHA-512 of
/// the image for slot A and of that for slot B. In a file the images follow, A first.
pub const HEAD: usize = LABEL_SIZE + 1 + 2 * (4 + DIGEST);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Head {
    pub label: Label,
    /// True if a version older than the board's is wanted.
    pub downgrade: bool,
    /// Length and hash of the image for slots A and B.
    pub images: [Digest; 2],
}

impl Head {
    /// Returns the bytes that are written, and signed.
    pub fn bytes(&self) -> [u8; HEAD] {
        let Self { label, downgrade, images: [a, b] } = self;
        let (lengths, downgrade) = ([a, b].map(|image| image.length.to_be_bytes()), [u8::from(*downgrade)]);
        let [of_a, of_b] = &lengths;
        let parts: [&[u8]; 6] = [&label.bytes(), &downgrade, of_a, &a.hash, of_b, &b.hash];
        super::signature::joined(parts)
    }

    pub fn parse(bytes: &[u8; HEAD]) -> Option<Self> {
        let (label, rest) = bytes.split_first_chunk()?;
        let (downgrade, rest) = rest.split_first()?;
        let image = |bytes: &[u8]| {
            let (length, hash) = bytes.split_first_chunk()?;
            Some(Digest { length: u32::from_be_bytes(*length), hash: hash.try_into().ok()? })
        };
        let (a, b) = rest.split_at_checked(4 + DIGEST)?;
        (*downgrade <= 1).then_some(())?;
        Some(Self { label: Label::parse(label)?, downgrade: *downgrade == 1, images: [image(a)?, image(b)?] })
    }
}
