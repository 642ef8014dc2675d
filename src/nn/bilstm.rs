//! A bidirectional LSTM layer over a whole sequence.
//!
//! Steps are taken in pairs: one input projection serves two of them. The backward direction
//! takes the pairs, and the steps inside a pair, in reverse. Both start from a zero state, so
//! the first step has no recurrent product.

use super::lstm::{self, Direction, Scratch};

/// A layer: forward and backward direction.
#[derive(Debug, Clone, Copy)]
pub struct Layer<'w> {
    /// Forward in time.
    pub forward: Direction<'w>,
    /// Backward in time.
    pub backward: Direction<'w>,
}

/// Which way a direction goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Way {
    /// First step first.
    Forward,
    /// Last step first.
    Backward,
}

/// Runs one direction over `input` and hands each step's hidden state (Q10) to `emit`.
///
/// `input` is the whole sequence, step pairs of `2 * inputs` values interleaved by column pair
/// ([`interleaved`]); its length says how many steps there are, an even number.
pub fn run<const H: usize>(
    direction: &Direction<'_>,
    way: Way,
    inputs: usize,
    input: &[i16],
    scratch: &mut Scratch<H>,
    mut emit: impl FnMut(usize, &[i16; H]),
) {
    scratch.cell_state = [0; H];
    let pairs = input.len() / (2 * inputs);
    let mut first = true;
    for n in 0..pairs {
        let pair = if way == Way::Forward { n } else { pairs - 1 - n };
        let Some(x) = input.chunks_exact(2 * inputs).nth(pair) else { return };
        lstm::project(direction, x, &mut scratch.projection);
        for k in 0..2 {
            let within = if way == Way::Forward { k } else { 1 - k };
            let [a, b] = &mut scratch.hidden;
            let (previous, next) = if k == 0 { (&b.0, &mut a.0) } else { (&a.0, &mut b.0) };
            let previous = (!first).then_some(previous.as_slice());
            lstm::step(direction, &scratch.projection, within, previous, &mut scratch.cell_state, next);
            first = false;
            emit(2 * pair + within, next);
        }
    }
}

/// Runs both directions and writes their hidden states as the next layer's input: `2 H` values
/// a step, forward first, interleaved in step pairs.
pub fn run_layer<const H: usize>(
    layer: &Layer<'_>,
    inputs: usize,
    input: &[i16],
    scratch: &mut Scratch<H>,
    output: &mut [i16],
) {
    for (direction, way, offset) in [(&layer.forward, Way::Forward, 0), (&layer.backward, Way::Backward, H)] {
        run(direction, way, inputs, input, scratch, |step, hidden| {
            for (u, h) in hidden.iter().enumerate() {
                if let Some(out) = output.get_mut(interleaved(step, offset + u, 2 * H)) {
                    *out = *h;
                }
            }
        });
    }
}

/// Where value `column` of `step` stands in a sequence of `columns` values a step.
#[inline]
#[must_use]
pub fn interleaved(step: usize, column: usize, columns: usize) -> usize {
    (step / 2) * 2 * columns + (column / 2) * 4 + (step % 2) * 2 + column % 2
}
