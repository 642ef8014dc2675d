//! The fully-connected layer on top computes the outputs of a step from both directions' hidden states.

/// The weights of one output over `2 H` hidden values, int16, and the scaling of its sum.
#[derive(Debug, Clone, Copy)]
pub struct Dense<'w> {
    /// Weights of the forward half, then of the backward half.
    pub weights: &'w [i16],
    pub bias: i32,
    /// Output code = (accumulator * multiplier + half) / 2^[`Dense::SHIFT`].
    pub multiplier: i32,
}

impl Dense<'_> {
    /// This row has no inputs; its output is zero.
    pub const EMPTY: Self = Self { weights: &[], bias: 0, multiplier: 0 };
    pub const SHIFT: u32 = 24;

    /// Returns the sum's part of a direction's hidden state, two units a word; add both and the bias. It stays in 32
    /// bits, as [`crate::model::Blob`] proves.
    pub fn partial(weights: &[i16], hidden: &[u32]) -> i32 {
        // Halfwords, as the processor's multiply-accumulate reads them: no unpacking.
        let hidden: &[i16] = bytemuck::must_cast_slice(hidden);
        weights.iter().zip(hidden).fold(0, |sum: i32, (w, h)| sum.wrapping_add(i32::from(*w) * i32::from(*h)))
    }

    /// Returns the scaled output of a complete sum (bias included), rounded to nearest, saturated.
    pub fn scale(&self, sum: i32) -> i32 {
        let product = i64::from(sum) * i64::from(self.multiplier) + (1 << (Self::SHIFT - 1));
        (product >> Self::SHIFT).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }
}
