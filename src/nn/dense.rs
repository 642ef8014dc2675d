//! The fully-connected layer on top: outputs of a step from both directions' hidden states.

use super::unpack;

/// Weights of one output over `2 H` hidden values, int16, and how its sum is scaled.
#[derive(Debug, Clone, Copy)]
pub struct Dense<'w> {
    /// Forward half, then backward half.
    pub weights: &'w [i16],
    /// In accumulator units.
    pub bias: i32,
    /// Output code = (accumulator * multiplier + half) / 2^[`Dense::SHIFT`].
    pub multiplier: i32,
}

impl Dense<'_> {
    /// Fraction bits of the multiplier.
    pub const SHIFT: u32 = 24;

    /// Part of the sum that one direction's hidden state gives; add both and the bias.
    ///
    /// `hidden` holds two units a word. The sum stays inside 32 bits: [`crate::model::Blob`]
    /// proves it for the weights at hand.
    #[must_use]
    pub fn partial(weights: &[i16], hidden: &[u32]) -> i32 {
        weights.as_chunks::<2>().0.iter().zip(hidden).fold(0, |sum: i32, ([w0, w1], word)| {
            let (h0, h1) = unpack(*word);
            sum.wrapping_add(i32::from(*w0) * h0).wrapping_add(i32::from(*w1) * h1)
        })
    }

    /// The scaled output of a whole sum (bias included), rounded to nearest, saturated.
    #[must_use]
    pub fn scale(&self, sum: i32) -> i32 {
        let product = i64::from(sum) * i64::from(self.multiplier) + (1 << (Self::SHIFT - 1));
        (product >> Self::SHIFT).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }
}
