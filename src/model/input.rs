//! Normalises codes to the input of a first layer, for both networks.

use super::file::Normalisation;
use crate::nn::{bilstm, pack};

/// Normalises a step's codes into its row of `COLUMNS`, two in a word and padded; returns how many were clamped.
pub(super) fn load_step<const INPUTS: usize, const COLUMNS: usize>(
    input: &mut [u32],
    step: usize,
    codes: impl Iterator<Item = i32>,
    normalisation: &[Normalisation; INPUTS],
    clamp: i32,
) -> u16 {
    const { assert!(COLUMNS == INPUTS.next_multiple_of(2), "the last input has no word, or the next row moves") };
    let mut clamped = 0;
    let mut values = [0; COLUMNS];
    for ((to, code), n) in values.iter_mut().zip(codes).zip(normalisation) {
        let value = normalise(code, *n);
        let inside = value.min(clamp).max(-clamp);
        clamped += u16::from(inside != value);
        *to = inside as i16;
    }
    for (k, [first, second]) in values.as_chunks::<2>().0.iter().enumerate() {
        if let Some(word) = input.get_mut(bilstm::word_index(step, 2 * k, COLUMNS)) {
            *word = pack(*first, *second);
        }
    }
    clamped
}

/// Returns (code - offset) * multiplier / 2^31 to nearest, saturated to 32 bits.
fn normalise(code: i32, n: Normalisation) -> i32 {
    let product = i64::from(code.saturating_sub(n.offset)) * i64::from(n.multiplier);
    ((product + (1 << 30)) >> 31).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}
