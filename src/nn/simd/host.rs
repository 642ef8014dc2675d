//! The kernel for hosts, on the `wide` crate's vectors (SSE2, AVX2 or NEON, as compiled).
//!
//! Four words of a record are two column pairs of all four gates: (i,f) (g,o) (i,f) (g,o). With
//! the matching columns copied beside each other, one multiply-add of halfword pairs does all
//! four packed rows; the low rows take the same words with their low bytes sign-extended.

use crate::nn::lstm::{Accumulators, Direction, set_hidden, update};
use wide::{i16x8, i32x4};

/// Packed and low sums, each (i,f) (g,o) (i,f) (g,o): the two halves are still to be added.
#[derive(Clone, Copy)]
struct Sums {
    packed: i32x4,
    low: i32x4,
}

impl Sums {
    const ZERO: Self = Self { packed: i32x4::ZERO, low: i32x4::ZERO };

    /// `x`: the words of two column pairs, each twice.
    #[inline]
    fn add(&mut self, packed: i16x8, low: i16x8, x: [u32; 4]) {
        let x: i16x8 = bytemuck::cast(x);
        self.packed += packed.dot(x);
        self.low += low.dot(x);
    }

    /// Accumulators, on top of where they started.
    #[inline]
    fn finish(self, start: Accumulators) -> Accumulators {
        let [packed, low] = [self.packed.to_array(), self.low.to_array()];
        core::array::from_fn(|k| {
            let sums = if k % 2 == 0 { low } else { packed };
            start[k].wrapping_add(sums[k / 2]).wrapping_add(sums[k / 2 + 2])
        })
    }
}

/// Packed rows and their low bytes.
#[inline]
fn rows(words: [u32; 4]) -> (i16x8, i16x8) {
    let packed: i16x8 = bytemuck::cast(words);
    (packed, (packed << 8) >> 8)
}

pub(in crate::nn) fn project<const U: usize>(
    direction: &Direction<'_>,
    x: &[u32],
    projection: &mut [[Accumulators; U]; 2],
) {
    let [first, second] = projection;
    let records = direction.input().chunks_exact(4 + direction.inputs());
    let (x_quads, x_tail) = x.as_chunks::<4>();
    for ((record, first), second) in records.zip(first).zip(second) {
        let (bias, words) = record.split_at(4);
        let (quads, tail) = words.as_chunks::<4>();
        let mut sums = [Sums::ZERO; 2];
        let mut quad = |words: [u32; 4], [a0, b0, a1, b1]: [u32; 4]| {
            let (packed, low) = rows(words);
            sums[0].add(packed, low, [a0, a0, a1, a1]);
            sums[1].add(packed, low, [b0, b0, b1, b1]);
        };
        for (words, x) in quads.iter().zip(x_quads) {
            quad(*words, *x);
        }
        if let ([r0, r1], [a, b]) = (tail, x_tail) {
            quad([*r0, *r1, 0, 0], [*a, *b, 0, 0]);
        }
        let bias = core::array::from_fn(|k| bias[k] as i32);
        *first = sums[0].finish(bias);
        *second = sums[1].finish(bias);
    }
}

pub(in crate::nn) fn step<const U: usize, const W: usize>(
    direction: &Direction<'_>,
    projection: &[Accumulators; U],
    previous: Option<&[u32; W]>,
    cell_state: &mut [i32; U],
    hidden: &mut [u32; W],
) {
    let records = direction.recurrent().chunks_exact(2 * W + 2);
    for (unit, ((record, projection), cell_state)) in records.zip(projection).zip(cell_state).enumerate() {
        let (words, multipliers) = record.split_at(2 * W);
        let mut acc = *projection;
        if let Some(previous) = previous {
            let mut sums = Sums::ZERO;
            for (words, [x0, x1]) in words.as_chunks::<4>().0.iter().zip(previous.as_chunks::<2>().0) {
                let (packed, low) = rows(*words);
                sums.add(packed, low, [*x0, *x0, *x1, *x1]);
            }
            acc = sums.finish(acc);
        }
        let (cell, h) = update(&acc, &[multipliers[0], multipliers[1]], *cell_state);
        *cell_state = cell;
        set_hidden(hidden, unit, h);
    }
}
