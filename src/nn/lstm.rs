//! Computes one LSTM direction in integers: the input projection of pairs of steps, and one recurrent step.
//!
//! The portable code here is the definition of the result (formats and packing: [`crate::nn`]). Where the processor
//! has a faster kernel (`nn/simd/`), [`project`] and [`step`] use it; the bits are the same.
//!
//! Weights are stored in the order in which they are read. With K inputs and U units:
//!
//! - input record of a unit, 4 + K words: the accumulators that its bias starts from, then for
//!   each pair of columns the packed words of gates (i, f) and (g, o);
//! - recurrent record of a unit, C + 2 words, C the units rounded up to a multiple of four: the
//!   packed words for each pair of columns, then the multipliers of (i, f) and (g, o);
//! - the inputs of two consecutive steps alternate word by word.

use super::{GATES, HIDDEN_FRACTION_BITS, activation, simd, unpack};

/// Holds the accumulators of one unit: row i, rows i and f packed, row g, rows g and o packed.
pub type Accumulators = [i32; GATES];

/// Words of an input record before its columns.
pub(super) const BIAS_WORDS: usize = GATES;
/// A direction has at most this many inputs, because a kernel may hold one unit's record on the stack.
pub const MAX_INPUTS: usize = 192;
/// Words of a recurrent record after its columns.
const MULTIPLIER_WORDS: usize = GATES / 2;

/// Holds the weights of one direction, in place. Lengths are checked once, here; the kernels rely on them.
#[derive(Debug, Clone, Copy)]
pub struct DirectionWeights<'w> {
    units: usize,
    inputs: usize,
    input: &'w [u32],
    recurrent: &'w [u32],
}

impl<'w> DirectionWeights<'w> {
    pub const fn input_words(units: usize, inputs: usize) -> usize {
        units * (BIAS_WORDS + inputs)
    }

    pub const fn recurrent_words(units: usize) -> usize {
        units * (Self::padded(units) + MULTIPLIER_WORDS)
    }

    /// Returns the number of columns of a recurrent record: the units, rounded up to a multiple of four.
    pub const fn padded(units: usize) -> usize {
        units.next_multiple_of(4)
    }

    /// Creates a direction over a file's records; `None` unless both are even, not zero, and the lengths fit them.
    pub const fn new(units: usize, inputs: usize, input: &'w [u32], recurrent: &'w [u32]) -> Option<Self> {
        let even = units.is_multiple_of(2) && inputs.is_multiple_of(2) && units > 0 && inputs > 0;
        if even
            && inputs <= MAX_INPUTS
            && input.len() == Self::input_words(units, inputs)
            && recurrent.len() == Self::recurrent_words(units)
        {
            Some(Self { units, inputs, input, recurrent })
        } else {
            None
        }
    }

    pub const fn units(&self) -> usize {
        self.units
    }

    /// Returns whether arrays for `room` units fit the direction, whose units are read in groups of four.
    pub const fn fits(&self, room: usize) -> bool {
        self.units == room || self.units < room && self.units.is_multiple_of(4)
    }

    pub const fn inputs(&self) -> usize {
        self.inputs
    }

    pub const fn input(&self) -> &'w [u32] {
        self.input
    }

    pub const fn recurrent(&self) -> &'w [u32] {
        self.recurrent
    }

    /// Returns the direction with its recurrent records in `room`, where `load` copies them; records that do not fit
    /// are read in place. A copy without wait states pays for itself in two or three steps.
    pub fn through<'a>(&self, room: &'a mut [u32], load: bool) -> DirectionWeights<'a>
    where
        'w: 'a,
    {
        let Some(room) = room.get_mut(..self.recurrent.len()) else { return *self };
        if load {
            simd::copy(self.recurrent, room);
        }
        DirectionWeights { recurrent: room, ..*self }
    }

    fn input_records(&self) -> impl Iterator<Item = (&'w [u32], &'w [u32])> {
        let words = (BIAS_WORDS + self.inputs).max(1);
        self.input.chunks_exact(words).filter_map(|record| record.split_at_checked(BIAS_WORDS))
    }

    fn recurrent_records(&self) -> impl Iterator<Item = (&'w [u32], &'w [u32])> {
        let columns = Self::padded(self.units);
        let words = (columns + MULTIPLIER_WORDS).max(1);
        self.recurrent.chunks_exact(words).filter_map(move |record| record.split_at_checked(columns))
    }
}

/// State and scratch of a direction of up to `U` units in `W` words, for `P` pairs of steps; fewer use the first.
#[derive(Debug, Clone)]
pub struct Scratch<const U: usize, const W: usize, const P: usize = 1> {
    /// Cell state, Q20.
    pub cell_state: [i32; U],
    /// Hidden state before and after a step, Q10, two units a word; the two alternate.
    pub hidden: [[u32; W]; 2],
    pub projection: [Projection<U>; P],
}

pub type Projection<const U: usize> = [[Accumulators; U]; 2];

impl<const U: usize, const W: usize, const P: usize> Scratch<U, W, P> {
    pub const ZERO: Self = {
        assert!(2 * W == DirectionWeights::padded(U), "W is half of U, U rounded up to a multiple of four");
        Self { cell_state: [0; U], hidden: [[0; W]; 2], projection: [[[[0; GATES]; U]; 2]; P] }
    };
}

/// Computes bias and input products of all units for pairs of steps, whose words alternate in `x`. Does nothing when
/// `x` or `U` does not fit the direction: a bug, at which debug builds panic.
pub fn project<const U: usize>(weights: &DirectionWeights<'_>, x: &[u32], projection: &mut [Projection<U>]) {
    let fits = x.len() == weights.inputs * projection.len() && weights.fits(U);
    debug_assert!(fits);
    if fits {
        simd::project(weights, x, projection);
    }
}

/// Computes a step of all units from its `projection` and the `previous` hidden state, `None` for zero: gates, cell
/// state, hidden state. What does not fit is treated as in [`project`].
pub fn step<const U: usize, const W: usize>(
    weights: &DirectionWeights<'_>,
    projection: &[Accumulators; U],
    previous: Option<&[u32; W]>,
    cell_state: &mut [i32; U],
    hidden: &mut [u32; W],
) {
    let fits = weights.fits(U) && 2 * W == DirectionWeights::padded(U);
    debug_assert!(fits);
    if fits {
        simd::step(weights, projection, previous, cell_state, hidden);
    }
}

#[inline]
fn accumulate(acc: &mut Accumulators, rows: &[u32], x: impl Iterator<Item = u32>) {
    for (rows, x) in rows.as_chunks::<2>().0.iter().zip(x) {
        let (x0, x1) = unpack(x);
        for (pair, word) in rows.iter().enumerate() {
            let (w0, w1) = unpack(*word);
            let low = i32::from(w0 as i8) * x0 + i32::from(w1 as i8) * x1;
            acc[2 * pair] = acc[2 * pair].wrapping_add(low);
            // Intermediate sums may wrap; the row bound makes the final difference exact.
            acc[2 * pair + 1] = acc[2 * pair + 1].wrapping_add(w0 * x0).wrapping_add(w1 * x1);
        }
    }
}

/// Computes [`project`] in portable code, which defines the result.
pub fn project_portable<const U: usize>(
    weights: &DirectionWeights<'_>,
    x: &[u32],
    projection: &mut [Projection<U>],
) {
    for (x, projection) in x.chunks_exact(weights.inputs.max(1)).zip(projection) {
        for (step, projection) in projection.iter_mut().enumerate() {
            for ((bias, rows), acc) in weights.input_records().zip(projection) {
                *acc = core::array::from_fn(|k| bias[k] as i32);
                accumulate(acc, rows, x.iter().skip(step).step_by(2).copied());
            }
        }
    }
}

/// Computes [`step`] in portable code, which defines the result.
pub fn step_portable<const U: usize, const W: usize>(
    weights: &DirectionWeights<'_>,
    projection: &[Accumulators; U],
    previous: Option<&[u32; W]>,
    cell_state: &mut [i32; U],
    hidden: &mut [u32; W],
) {
    let units = weights.recurrent_records().zip(projection).zip(cell_state).enumerate();
    for (unit, (((rows, multipliers), projection), cell_state)) in units {
        let mut acc = *projection;
        if let Some(previous) = previous {
            accumulate(&mut acc, rows, previous.iter().copied());
        }
        let (cell, h) = update(&acc, &[multipliers[0], multipliers[1]], *cell_state);
        *cell_state = cell;
        set_hidden(hidden, unit, h);
    }
}

#[inline]
fn set_hidden(hidden: &mut [u32], unit: usize, h: i16) {
    let word = &mut hidden[unit / 2];
    *word = if unit.is_multiple_of(2) {
        *word & 0xFFFF_0000 | u32::from(h as u16)
    } else {
        *word & 0xFFFF | u32::from(h as u16) << 16
    };
}

/// Computes equations 7 to 12 of the paper: a unit's new cell state and hidden state.
#[inline]
pub(super) fn update(acc: &Accumulators, multipliers: &[u32; 2], cell_state: i32) -> (i32, i16) {
    let low = |pair: usize| scale(acc[2 * pair], unpack(multipliers[pair]).0);
    // 256 times the high row's sum; the shift by 8 comes after the multiplication.
    let high =
        |pair: usize| scale(acc[2 * pair + 1].wrapping_sub(acc[2 * pair]), unpack(multipliers[pair]).1) >> 8;
    let input_gate = upper(activation::sigmoid(activation::saturate(low(0))));
    let forget_gate = upper(activation::sigmoid(activation::saturate(high(0))));
    let candidate = upper(activation::tanh(activation::saturate(low(1))));
    let output_gate = upper(activation::sigmoid(activation::saturate(high(1))));

    // Q20 * Q15 >> 16 is Q19; Q15 * Q15 is Q30.
    let kept = scale(cell_state, forget_gate);
    let added = (input_gate * candidate) >> 10;
    let cell_state = added.saturating_add(kept.saturating_mul(2));
    let squashed = upper(activation::tanh(activation::saturate(cell_state >> 6)));
    let hidden = (output_gate * squashed + (1 << 19)) >> (30 - HIDDEN_FRACTION_BITS);
    (cell_state, hidden as i16)
}

/// Returns the product of 32 x 16 bits without its lower 16 bits.
#[inline]
fn scale(value: i32, factor: i32) -> i32 {
    ((i64::from(value) * i64::from(factor)) >> 16) as i32
}

#[inline]
fn upper(word: i32) -> i32 {
    word >> 16
}

/// Returns how large a unit's accumulators (i, f, g, o) can be, for inputs up to `input_max`.
pub fn row_bound(weights: &DirectionWeights<'_>, unit: usize, input_max: i32) -> [i64; GATES] {
    let mut bound = [0i64; GATES];
    let records = weights.input_records().nth(unit).zip(weights.recurrent_records().nth(unit));
    let Some(((bias, input), (recurrent, _))) = records else { return bound };
    for (bound, [low, packed]) in bound.as_chunks_mut::<2>().0.iter_mut().zip(bias.as_chunks::<2>().0) {
        let (low, packed) = (*low as i32, *packed as i32);
        // 256 times the high row's bias, modulo 2^32: exact where it is below 2^23.
        *bound = [i64::from(low).abs(), i64::from(packed.wrapping_sub(low) >> 8).abs()];
    }
    for (rows, max) in [(input, input_max), (recurrent, super::HIDDEN_MAX)] {
        for (n, word) in rows.iter().enumerate() {
            let (first, second) = unpack(*word);
            for halfword in [first, second] {
                let low = i32::from(halfword as i8);
                let high = (halfword - low) >> 8;
                bound[2 * (n % 2)] += i64::from(low.abs() * max);
                bound[2 * (n % 2) + 1] += i64::from(high.abs() * max);
            }
        }
    }
    bound
}

/// [`row_bound`] must stay below this: low rows fill an int32, and so do high rows times 256.
pub const ROW_LIMIT: [i64; GATES] = [1 << 31, 1 << 23, 1 << 31, 1 << 23];
