//! Whether values are still what they were, or the same once more, without a copy of them.

use core::hash::Hash;
use hash32::{FnvHasher, Hasher};

/// FNV-1a (Fowler, Noll, Vo) of them, 32 bits: one changed byte always changes it.
pub fn seal(values: &impl Hash) -> u32 {
    let mut hasher = FnvHasher::default();
    values.hash(&mut hasher);
    hasher.finish32()
}
