//! A signature authenticates written data, for one data identifier, board and counter value (Ed25519, RFC 8032).
//!
//! Written data are followed by a trailer of 69 bytes: 0 for this board alone or 1 for any board, a counter (4
//! bytes), and the signature (64 bytes). The signed bytes are those of [`message`]: a fixed text, so that no answer
//! to a challenge is accepted as a signature; the identifier that is written, or the routine that activates a
//! download; the serial number of the board, or zeros; the counter; the length of the content and its SHA-512.

use crate::store::access::KEY;
use salty::{CompressedY, EdwardsPoint, Scalar};
use sha2::{Digest as _, Sha512};

pub const SERIAL: usize = 12;
pub const SIGNATURE: usize = 64;
pub const TRAILER: usize = 1 + 4 + SIGNATURE;
pub const SEED: usize = 32;
pub const DIGEST: usize = 64;

const CONTENT: [u8; 17] = *b"gyronet content 1";
const ACCESS: [u8; 16] = *b"gyronet access 1";
/// Length of the message that is signed for a content, and for a challenge, bytes.
const CONTENT_MESSAGE: usize = CONTENT.len() + 2 + SERIAL + 4 + 4 + DIGEST;
const ACCESS_MESSAGE: usize = ACCESS.len() + SERIAL + SEED;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest {
    pub length: u32,
    pub hash: [u8; DIGEST],
}

#[inline(never)]
pub fn digest(content: &[u8]) -> Digest {
    Digest { length: content.len() as u32, hash: Sha512::digest(content).into() }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Statement {
    /// Data identifier that is written, or routine that activates a download.
    pub target: u16,
    /// Serial number of the board; zeros for any board.
    pub serial: [u8; SERIAL],
    /// Counter, greater than that of any earlier signature.
    pub counter: u32,
}

/// Returns the bytes that are signed for a content.
pub fn message(statement: &Statement, digest: &Digest) -> [u8; CONTENT_MESSAGE] {
    joined([
        &CONTENT,
        &statement.target.to_be_bytes(),
        &statement.serial,
        &statement.counter.to_be_bytes(),
        &digest.length.to_be_bytes(),
        &digest.hash,
    ])
}

/// Returns the bytes that are signed to answer a challenge of a board.
pub fn challenge(serial: &[u8; SERIAL], seed: &[u8; SEED]) -> [u8; ACCESS_MESSAGE] {
    joined([&ACCESS, serial, seed])
}

pub(super) fn joined<const N: usize, const PARTS: usize>(parts: [&[u8]; PARTS]) -> [u8; N] {
    let mut message = [0; N];
    message.iter_mut().zip(parts.into_iter().flatten()).for_each(|(place, byte)| *place = *byte);
    message
}

/// Returns whether a signature is valid for a public key (RFC 8032 5.1.7, without the cofactor), with S below the
/// order: not malleable. All inputs are public: the time need not be constant.
#[inline(never)]
pub fn is_valid(key: &[u8; KEY], message: &[u8], signature: &[u8; SIGNATURE]) -> bool {
    let Some((r, s)) = signature.split_first_chunk::<32>() else { return false };
    let (Ok(s), Ok(point)) = (<&[u8; 32]>::try_from(s), CompressedY(*key).decompressed()) else {
        return false;
    };
    if !Scalar::from_bytes(s).is_canonical() {
        return false;
    }
    let k = Scalar::from_u512_le(
        &Sha512::new().chain_update(r).chain_update(key).chain_update(message).finalize().into(),
    );
    sum_of_products(s, k.as_bytes(), &-&point) == *r
}

/// Returns s B + k P, encoded, with B the base point, in one pass over both scalars from the highest bit.
#[inline(never)]
fn sum_of_products(s: &[u8; 32], k: &[u8; 32], point: &EdwardsPoint) -> [u8; 32] {
    let base = EdwardsPoint::basepoint();
    let both = &base + point;
    let mut sum = EdwardsPoint::neutral_element();
    for (s, k) in s.iter().zip(k).rev() {
        for bit in (0..8).rev() {
            sum = &sum + &sum;
            match (s >> bit & 1, k >> bit & 1) {
                (0, 0) => {}
                (0, _) => sum = &sum + point,
                (_, 0) => sum = &sum + &base,
                _ => sum = &sum + &both,
            }
        }
    }
    sum.compressed().0
}

/// Returns whether bytes are a key: a point, not one of the eight of low order, for which anyone can sign.
#[inline(never)]
pub fn is_key(key: &[u8; KEY]) -> bool {
    let Ok(mut point) = CompressedY(*key).decompressed() else { return false };
    for _ in 0..3 {
        point = &point + &point;
    }
    point.compressed() != EdwardsPoint::neutral_element().compressed()
}
