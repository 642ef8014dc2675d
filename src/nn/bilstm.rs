//! Runs a bidirectional LSTM layer over a whole sequence in resumable pieces.
//!
//! Steps run in pairs: one input projection serves two of them. The backward direction runs the pairs, and the steps
//! inside a pair, in reverse. Both start from a zero state, so the first step has no recurrent product.
//!
//! A sequence of an even number of steps with K values each lies in `K / 2` words a step; the
//! two steps of a pair alternate word by word.

use super::lstm::{self, DirectionWeights, Scratch};

#[derive(Debug, Clone, Copy)]
pub struct Layer<'w> {
    pub forward: DirectionWeights<'w>,
    pub backward: DirectionWeights<'w>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    Forward,
    Backward,
}

/// Tracks one direction's pass through a sequence; [`Pass::advance`] runs its next pairs of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pass {
    direction: Direction,
    done: usize,
}

impl Pass {
    pub const fn new(direction: Direction) -> Self {
        Self { direction, done: 0 }
    }

    /// Runs the next pairs of steps, as many as `scratch` has projections for, and passes each step's number and
    /// hidden state (Q10) to `emit`; returns whether there are more.
    ///
    /// `input` is the whole sequence. `room` receives a copy of the direction's recurrent records for the pass, if it
    /// is large enough ([`DirectionWeights::through`]).
    pub fn advance<const U: usize, const W: usize, const P: usize>(
        &mut self,
        weights: &DirectionWeights<'_>,
        input: &[u32],
        scratch: &mut Scratch<U, W, P>,
        room: &mut [u32],
        mut emit: impl FnMut(usize, &[u32; W]),
    ) -> bool {
        let words = weights.inputs();
        let pairs = input.len().checked_div(words).unwrap_or(0);
        // Weights that do not fit the caller's arrays run no step; a checked blob has no such weights.
        if self.done >= pairs || !weights.fits(U) {
            return false;
        }
        let weights = &weights.through(room, self.done == 0);
        let Scratch { cell_state, hidden: [even, odd], projection } = scratch;
        let count = (pairs - self.done).min(P);
        let from = match self.direction {
            Direction::Forward => self.done,
            Direction::Backward => pairs - self.done - count,
        };
        let columns = input.get(from * words..(from + count) * words);
        let Some((columns, projection)) = columns.zip(projection.get_mut(..count)) else { return false };
        lstm::project(weights, columns, projection);
        if self.done == 0 {
            *cell_state = [0; U];
        }
        for k in 0..count {
            let (pair, [first, second]) = match self.direction {
                Direction::Forward => (k, [0, 1]),
                Direction::Backward => (count - 1 - k, [1, 0]),
            };
            let Some(projection) = projection.get(pair) else { break };
            let pair = from + pair;
            let previous = (self.done > 0).then_some(&*odd);
            lstm::step(weights, &projection[first], previous, cell_state, even);
            emit(2 * pair + first, even);
            lstm::step(weights, &projection[second], Some(even), cell_state, odd);
            emit(2 * pair + second, odd);
            self.done += 1;
        }
        self.done < pairs
    }
}

/// Returns the index of word `column / 2` of `step` in a sequence of `columns` values a step.
#[inline]
pub const fn word_index(step: usize, column: usize, columns: usize) -> usize {
    (step / 2) * columns + (column / 2) * 2 + step % 2
}

/// Writes a step's hidden state into a sequence of `columns` values, from `offset` on: the next layer's input.
pub fn store(sequence: &mut [u32], step: usize, offset: usize, columns: usize, units: usize, hidden: &[u32]) {
    // Of each word, the value of the pair's first step, then that of the second.
    let pairs =
        sequence.get_mut(word_index(step & !1, offset, columns)..).unwrap_or_default().as_chunks_mut().0;
    let words = pairs.iter_mut().zip(hidden.iter().take(units / 2));
    if step.is_multiple_of(2) {
        words.for_each(|([first, _], word)| *first = *word);
    } else {
        words.for_each(|([_, second], word)| *second = *word);
    }
}

/// Two bidirectional layers over a sequence, in bounded pieces: pairs of steps in a direction of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// Current direction: 0 and 1 are layer 1 forward and backward, 2 and 3 layer 2.
    stage: u8,
    pass: Pass,
}

impl Run {
    pub const START: Self = Self { stage: 0, pass: Pass::new(Direction::Forward) };

    /// Runs the next piece; returns whether there are more.
    ///
    /// `input` is the first layer's sequence, `between` receives the second layer's and must have exactly its length;
    /// `room` is as in [`Pass::advance`]. `emit` gets layer 2's hidden states: direction, step, state.
    pub fn advance<const U: usize, const W: usize, const P: usize>(
        &mut self,
        layers: &[Layer<'_>; 2],
        input: &[u32],
        between: &mut [u32],
        scratch: &mut Scratch<U, W, P>,
        room: &mut [u32],
        mut emit: impl FnMut(Direction, usize, &[u32; W]),
    ) -> bool {
        let units = layers[0].forward.units();
        let (direction, offset) =
            if self.stage.is_multiple_of(2) { (Direction::Forward, 0) } else { (Direction::Backward, units) };
        let [first, second] = layers.each_ref().map(|layer| match direction {
            Direction::Forward => &layer.forward,
            Direction::Backward => &layer.backward,
        });
        let more = match self.stage {
            0 | 1 => self.pass.advance(first, input, scratch, room, |step, hidden| {
                store(between, step, offset, 2 * units, units, hidden);
            }),
            2 | 3 => self
                .pass
                .advance(second, between, scratch, room, |step, hidden| emit(direction, step, hidden)),
            _ => return false,
        };
        if !more {
            self.stage += 1;
            self.pass = Pass::new(if self.stage.is_multiple_of(2) {
                Direction::Forward
            } else {
                Direction::Backward
            });
        }
        self.stage < 4
    }
}
