//! The fully-connected layer on top: one output a step, from both directions' hidden states.

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
    /// Sums of up to 2^15 products of 15 and 11 bits stay inside 32 bits for the layer sizes
    /// here; [`crate::model::Blob`] proves it for the weights at hand.
    #[must_use]
    pub fn partial(weights: &[i16], hidden: &[i16]) -> i32 {
        weights.iter().zip(hidden).map(|(w, h)| i32::from(*w) * i32::from(*h)).fold(0, i32::wrapping_add)
    }

    /// The scaled output of a whole sum (bias included), rounded to nearest, saturated.
    #[must_use]
    pub fn scale(&self, sum: i32) -> i32 {
        let product = i64::from(sum) * i64::from(self.multiplier) + (1 << (Self::SHIFT - 1));
        (product >> Self::SHIFT).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }
}
