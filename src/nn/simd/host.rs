//! The kernel for hosts, with the `wide` crate's vectors (SSE2, AVX2 or NEON, as compiled).
//!
//! Four words of a record are two column pairs of all four gates: (i,f) (g,o) (i,f) (g,o). With
//! the matching columns copied beside each other, one multiply-add of halfword pairs does all
//! four packed rows; the low rows take the same words with their low bytes sign-extended.

use crate::nn::lstm::{Accumulators, DirectionWeights, Projection, update};
use crate::nn::pack;
use wide::{i16x8, i32x4};

/// Holds packed and low sums, each (i,f) (g,o) (i,f) (g,o); their two halves are still to be added.
#[derive(Clone, Copy)]
struct Sums {
    packed: i32x4,
    low: i32x4,
}

impl Sums {
    const ZERO: Self = Self { packed: i32x4::ZERO, low: i32x4::ZERO };

    /// Adds the products of a unit's record. `x` holds the words of two column pairs, each twice.
    #[inline]
    fn add(&mut self, packed: i16x8, low: i16x8, x: [u32; 4]) {
        let x: i16x8 = bytemuck::cast(x);
        self.packed += packed.dot(x);
        self.low += low.dot(x);
    }

    #[inline]
    fn finish(self, start: Accumulators) -> Accumulators {
        let [packed, low] = [self.packed.to_array(), self.low.to_array()];
        core::array::from_fn(|k| {
            let sums = if k % 2 == 0 { low } else { packed };
            start[k].wrapping_add(sums[k / 2]).wrapping_add(sums[k / 2 + 2])
        })
    }
}

/// Multiplies packed rows and their low bytes.
#[inline]
fn rows(words: [u32; 4]) -> (i16x8, i16x8) {
    let packed: i16x8 = bytemuck::cast(words);
    (packed, (packed << 8) >> 8)
}

/// Adds the products of a pair of units with one or two steps' columns.
#[inline]
fn accumulate<const STEPS: usize>(
    sums: &mut [[Sums; STEPS]; 2],
    units: [&[u32; 4]; 2],
    columns: [[u32; 4]; STEPS],
) {
    for (sums, words) in sums.iter_mut().zip(units) {
        let (packed, low) = rows(*words);
        for (sums, x) in sums.iter_mut().zip(columns) {
            sums.add(packed, low, x);
        }
    }
}

pub(in crate::nn) fn project<const U: usize>(
    weights: &DirectionWeights<'_>,
    x: &[u32],
    projection: &mut [Projection<U>],
) {
    for (x, [first, second]) in x.chunks_exact(weights.inputs().max(1)).zip(projection) {
        project_pair(weights, x, first, second);
    }
}

fn project_pair(
    weights: &DirectionWeights<'_>,
    x: &[u32],
    first: &mut [Accumulators],
    second: &mut [Accumulators],
) {
    let inputs = weights.inputs();
    let (x_quads, x_tail) = x.as_chunks::<4>();
    // Units come in pairs, so that the columns are laid out once for two of them.
    let outputs = first.as_chunks_mut::<2>().0.iter_mut().zip(second.as_chunks_mut::<2>().0);
    for (pair, (first, second)) in weights.input().chunks_exact(2 * (4 + inputs)).zip(outputs) {
        let (a, b) = pair.split_at(4 + inputs);
        let ((a_bias, a), (b_bias, b)) = (a.split_at(4), b.split_at(4));
        let mut sums = [[Sums::ZERO; 2]; 2];
        let columns = |[a0, b0, a1, b1]: [u32; 4]| [[a0, a0, a1, a1], [b0, b0, b1, b1]];
        for ((a, b), x) in a.as_chunks().0.iter().zip(b.as_chunks().0).zip(x_quads) {
            accumulate(&mut sums, [a, b], columns(*x));
        }
        if let ([a0, a1], [b0, b1], [x0, x1]) = (a.as_chunks::<4>().1, b.as_chunks::<4>().1, x_tail) {
            accumulate(&mut sums, [&[*a0, *a1, 0, 0], &[*b0, *b1, 0, 0]], columns([*x0, *x1, 0, 0]));
        }
        for (unit, bias) in [a_bias, b_bias].into_iter().enumerate() {
            let bias = core::array::from_fn(|k| bias[k] as i32);
            first[unit] = sums[unit][0].finish(bias);
            second[unit] = sums[unit][1].finish(bias);
        }
    }
}

pub(in crate::nn) fn step<const U: usize, const W: usize>(
    weights: &DirectionWeights<'_>,
    projection: &[Accumulators; U],
    previous: Option<&[u32; W]>,
    cell_state: &mut [i32; U],
    hidden: &mut [u32; W],
) {
    step_units(weights, projection, previous.map(<[u32; W]>::as_slice), cell_state, hidden);
}

fn step_units(
    weights: &DirectionWeights<'_>,
    projection: &[Accumulators],
    previous: Option<&[u32]>,
    cell_state: &mut [i32],
    hidden: &mut [u32],
) {
    let projection = projection.as_chunks::<2>().0;
    let cell_state = cell_state.as_chunks_mut::<2>().0;
    let columns = DirectionWeights::padded(weights.units());
    let pairs = weights.recurrent().chunks_exact(2 * (columns + 2));
    for (((pair, start), cell_state), hidden) in pairs.zip(projection).zip(cell_state).zip(hidden) {
        let (a, b) = pair.split_at(columns + 2);
        let ((a, a_multipliers), (b, b_multipliers)) = (a.split_at(columns), b.split_at(columns));
        let mut acc = *start;
        if let Some(previous) = previous {
            let mut sums = [[Sums::ZERO]; 2];
            let rows = a.as_chunks().0.iter().zip(b.as_chunks().0);
            for ((a, b), [x0, x1]) in rows.zip(previous.as_chunks::<2>().0) {
                accumulate(&mut sums, [a, b], [[*x0, *x0, *x1, *x1]]);
            }
            acc = core::array::from_fn(|unit| sums[unit][0].finish(acc[unit]));
        }
        let h: [i16; 2] = core::array::from_fn(|unit| {
            let multipliers = [a_multipliers, b_multipliers][unit];
            let (cell, h) = update(&acc[unit], &[multipliers[0], multipliers[1]], cell_state[unit]);
            cell_state[unit] = cell;
            h
        });
        *hidden = pack(h[0], h[1]);
    }
}
