//! Recurrent networks in integers, so that every machine gets the same bits.
//!
//! Weights are immutable slices, separate from the state, which the caller owns. The number formats:
//!
//! | what | type | format |
//! |---|---|---|
//! | weights of a gate row | int8, +-127 | value x row scale |
//! | network input | int16 | Q10 of the normalised feature, clamped (blob) |
//! | hidden state `h` | int16 | Q10, +-1024 |
//! | accumulator of a gate row | int32 | row scale x 2^-10 |
//! | gate input | 18 bit, saturated | Q14, +-8 |
//! | gate output | int16 | Q15 ([`activation`]) |
//! | cell state `c` | int32 | Q20 |
//! | weight of a linear layer | int32 | Q24 of output code over input code ([`linear`]) |
//!
//! **Two rows in one multiply.** The int8 weights of two gates of a unit share a halfword, `256 * high + low`, with
//! (low, high) = (i, f) and (g, o). A 16 x 16 bit multiply-accumulate over it sums `256 * high_row + low_row`; a
//! second one over the sign-extended low bytes sums `low_row`. A high row's accumulator is thus limited to +-2^23,
//! which [`crate::model::Blob`] proves for every row and all inputs before any weight is used ([`lstm::row_bound`]).
//!
//! **Rounding.** A product is scaled by an arithmetic right shift; where half an LSB matters it is added before: in
//! the row's bias by the quantiser, in `h` by the kernel.

pub mod activation;
pub mod bilstm;
pub mod dense;
pub mod linear;
pub mod lstm;
mod simd;

pub const HIDDEN_FRACTION_BITS: u32 = 10;
/// The hidden state's largest magnitude is 1.0.
pub const HIDDEN_MAX: i32 = 1 << HIDDEN_FRACTION_BITS;
pub const GATE_FRACTION_BITS: u32 = 14;
/// An LSTM unit has this many gates, in PyTorch's order: input, forget, cell candidate, output.
pub const GATES: usize = 4;

#[derive(Debug, Clone, Copy)]
#[repr(C, align(4))]
pub struct Aligned<T>(pub T);

/// Packs two consecutive columns into one word, as the kernels load them: the first in the lower half.
#[inline]
pub const fn pack(first: i16, second: i16) -> u32 {
    first as u16 as u32 | (second as u16 as u32) << 16
}

#[inline]
pub const fn unpack(word: u32) -> (i32, i32) {
    (word as i16 as i32, word as i32 >> 16)
}
