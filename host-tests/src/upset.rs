//! A bit of a value that flips where it lies in memory, and which field of it that was.

/// Flips a bit, counted from the value's first byte.
///
/// # Panics
/// Beyond the value.
#[allow(unsafe_code)]
pub fn flip<T>(value: &mut T, bit: usize) {
    assert!(bit < 8 * size_of::<T>(), "bit {bit} of {} bytes", size_of::<T>());
    // SAFETY: the byte lies inside the value, which is borrowed mutably. What it makes of the value
    // may be no valid one, as it would be on a board: callers do this in a process that may die, and
    // the volatile access keeps the compiler from knowing of it. No safe way leads to the bits of
    // private fields, and a copy as plain numbers would not have the enumerations to flip.
    unsafe {
        let byte = std::ptr::from_mut(value).cast::<u8>().add(bit / 8);
        byte.write_volatile(byte.read_volatile() ^ 1 << (bit % 8));
    }
}

/// Where two values differ that were written with `{:#?}`: the names of the first field that
/// does, outermost first.
#[must_use]
pub fn first_difference(before: &str, after: &str) -> Option<String> {
    let at = before.lines().zip(after.lines()).position(|(before, after)| before != after)?;
    let mut deepest = usize::MAX;
    let mut names: Vec<&str> = Vec::new();
    for line in before.lines().take(at + 1).collect::<Vec<_>>().into_iter().rev() {
        let text = line.trim_start();
        let depth = line.len() - text.len();
        if depth < deepest {
            deepest = depth;
            names.extend(text.split_once(':').map(|(name, _)| name));
        }
    }
    Some(names.into_iter().rev().collect::<Vec<_>>().join("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flipped_bit_is_found_again() {
        #[derive(Debug)]
        struct Inner {
            values: [u32; 3],
        }
        #[derive(Debug)]
        struct Outer {
            first: u8,
            inner: Inner,
        }
        let mut value = Outer { first: 1, inner: Inner { values: [2, 3, 4] } };
        let before = format!("{value:#?}");
        flip(&mut value.inner, 32 + 31);
        assert_eq!((value.first, value.inner.values), (1, [2, 3 | 1 << 31, 4]));
        let after = format!("{value:#?}");
        assert_eq!(first_difference(&before, &after).as_deref(), Some("inner.values"));
        assert_eq!(first_difference(&before, &before), None);
    }
}
