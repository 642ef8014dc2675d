//! One LSTM direction in integers: the input projection of two steps, and one recurrent step.
//!
//! This portable code is the definition of the result (formats and packing: [`crate::nn`]).
//! Memory is laid out in the order in which it is read:
//!
//! - a matrix of `4 H` gate rows and `K` columns is `H` units x `K/2` column pairs x 4 packed
//!   halfwords: `(i,f)[j] (i,f)[j+1] (g,o)[j] (g,o)[j+1]`;
//! - bias and projection are four accumulators a unit: `i`, packed `(i,f)`, `g`, packed `(g,o)`;
//! - inputs of two consecutive steps are interleaved by column pair: `x0[j] x0[j+1] x1[j] x1[j+1]`.

use super::{GATES, HIDDEN_FRACTION_BITS, activation};

/// Accumulators of one unit: row i, rows i and f packed, row g, rows g and o packed.
pub type Accumulators = [i32; GATES];

/// Weights of one direction, as they lie in the blob.
#[derive(Debug, Clone, Copy)]
pub struct Direction<'w> {
    /// Rounding and bias of each row, in accumulator units.
    pub bias: &'w [Accumulators],
    /// Multiplier of each row: gate input (Q14) = accumulator * multiplier / 2^16.
    pub multiplier: &'w [[i16; GATES]],
    /// Packed matrix over the inputs, `4 * units * inputs / 2` halfwords.
    pub input: &'w [i16],
    /// Packed matrix over the hidden state, `4 * units * units / 2` halfwords.
    pub recurrent: &'w [i16],
}

/// State and scratch of one direction with `H` units.
#[derive(Debug, Clone)]
pub struct Scratch<const H: usize> {
    /// Cell state, Q20.
    pub cell_state: [i32; H],
    /// Hidden state before and after a step, Q10; which is which alternates.
    pub hidden: [super::Aligned<[i16; H]>; 2],
    /// Input projections of two consecutive steps.
    pub projection: [[Accumulators; 2]; H],
}

impl<const H: usize> Scratch<H> {
    /// All zero.
    pub const ZERO: Self =
        Self { cell_state: [0; H], hidden: [super::Aligned([0; H]); 2], projection: [[[0; GATES]; 2]; H] };
}

/// Adds the products of one unit's packed rows with `x` to its accumulators.
///
/// `rows` holds four halfwords and `x` two values a column pair.
#[inline]
fn accumulate<'x>(acc: &mut Accumulators, rows: &[i16], x: impl Iterator<Item = &'x [i16]>) {
    for (w, x) in rows.chunks_exact(4).zip(x) {
        let (x0, x1) = (i32::from(x[0]), i32::from(x[1]));
        for pair in 0..2 {
            let (w0, w1) = (w[2 * pair], w[2 * pair + 1]);
            let low = i32::from(w0 as i8) * x0 + i32::from(w1 as i8) * x1;
            let packed = i32::from(w0) * x0 + i32::from(w1) * x1;
            acc[2 * pair] = acc[2 * pair].wrapping_add(low);
            // Wraps on the way; the blob's row bound makes the final difference exact.
            acc[2 * pair + 1] = acc[2 * pair + 1].wrapping_add(packed);
        }
    }
}

/// Bias and input products of all units for two consecutive steps.
///
/// `x`: the two steps' inputs, interleaved by column pair.
pub fn project(direction: &Direction<'_>, x: &[i16], projection: &mut [[Accumulators; 2]]) {
    // Four halfwords for two columns; both steps together are as many values as that.
    let row_len = x.len();
    let rows = direction.input.chunks_exact(row_len);
    for ((rows, bias), out) in rows.zip(direction.bias).zip(projection) {
        for (step, acc) in out.iter_mut().enumerate() {
            *acc = *bias;
            accumulate(acc, rows, x.chunks_exact(4).map(|quad| &quad[2 * step..2 * step + 2]));
        }
    }
}

/// One recurrent step of all units: gates, cell state, hidden state.
///
/// `step`: which of the two projected steps. `previous`: the hidden state before it; `None`
/// for the zero state that a sequence starts from.
pub fn step(
    direction: &Direction<'_>,
    projection: &[[Accumulators; 2]],
    step: usize,
    previous: Option<&[i16]>,
    cell_state: &mut [i32],
    hidden: &mut [i16],
) {
    let row_len = 2 * hidden.len();
    let units = cell_state.iter_mut().zip(hidden).zip(projection).zip(direction.multiplier).enumerate();
    for (u, (((c, h), projection), multiplier)) in units {
        let mut acc = projection[step & 1];
        if let (Some(previous), Some(rows)) = (previous, direction.recurrent.chunks_exact(row_len).nth(u)) {
            accumulate(&mut acc, rows, previous.chunks_exact(2));
        }
        (*c, *h) = update(acc, multiplier, *c);
    }
}

/// Equations 7 to 12 of the paper for one unit: accumulators and cell state to new cell state
/// and hidden state.
#[inline]
fn update(acc: Accumulators, multiplier: &[i16; GATES], cell_state: i32) -> (i32, i16) {
    let low = |pair: usize| scale(acc[2 * pair], multiplier[2 * pair]);
    // 256 times the high row's sum; the shift by 8 comes after the multiplication.
    let high =
        |pair: usize| scale(acc[2 * pair + 1].wrapping_sub(acc[2 * pair]), multiplier[2 * pair + 1]) >> 8;
    let input_gate = upper(activation::sigmoid(activation::saturate(low(0))));
    let forget_gate = upper(activation::sigmoid(activation::saturate(high(0))));
    let candidate = upper(activation::tanh(activation::saturate(low(1))));
    let output_gate = upper(activation::sigmoid(activation::saturate(high(1))));

    // Q20 * Q15 >> 16 is Q19; Q15 * Q15 is Q30.
    let kept = ((i64::from(cell_state) * i64::from(forget_gate)) >> 16) as i32;
    let added = (input_gate * candidate) >> 10;
    let cell_state = added.saturating_add(kept.saturating_mul(2));
    let squashed = upper(activation::tanh(activation::saturate(cell_state >> 6)));
    let hidden = (output_gate * squashed + (1 << 19)) >> (30 - HIDDEN_FRACTION_BITS);
    (cell_state, hidden as i16)
}

/// 32 x 16 bit product without its lower 16 bits.
#[inline]
fn scale(acc: i32, multiplier: i16) -> i32 {
    ((i64::from(acc) * i64::from(multiplier)) >> 16) as i32
}

/// The upper half of a word.
#[inline]
fn upper(word: i32) -> i32 {
    word >> 16
}

/// Largest magnitude that the accumulators of one unit can reach, for inputs up to `input_max`
/// and any hidden state: rows i, f, g, o.
#[must_use]
pub fn row_bound(direction: &Direction<'_>, unit: usize, input_max: i32) -> [i64; GATES] {
    let mut bound = [0i64; GATES];
    let Some(bias) = direction.bias.get(unit) else { return bound };
    for pair in 0..2 {
        let low = bias[2 * pair];
        bound[2 * pair] = i64::from(low).abs();
        // 256 times the high row's bias, modulo 2^32: all of it, where it is below 2^23.
        bound[2 * pair + 1] = i64::from(bias[2 * pair + 1].wrapping_sub(low) >> 8).abs();
    }
    let units = direction.bias.len();
    for (matrix, max) in [(direction.input, input_max), (direction.recurrent, super::HIDDEN_MAX)] {
        let row_len = matrix.len() / units;
        for quad in matrix[unit * row_len..(unit + 1) * row_len].chunks_exact(4) {
            for (n, halfword) in quad.iter().enumerate() {
                let low = i64::from(*halfword as i8);
                let high = (i64::from(*halfword) - low) >> 8;
                bound[2 * (n / 2)] += low.abs() * i64::from(max);
                bound[2 * (n / 2) + 1] += high.abs() * i64::from(max);
            }
        }
    }
    bound
}

/// What [`row_bound`] must stay below: low rows fill an int32, 256 times a high row does.
pub const ROW_LIMIT: [i64; GATES] = [1 << 31, 1 << 23, 1 << 31, 1 << 23];
