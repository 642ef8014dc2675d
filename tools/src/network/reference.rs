//! Computes the networks in plain f32, the reference for the integer code; it is never optimised.
//!
//! It follows equations 7 to 12 of Zhao et al., with the weights as PyTorch lays them out: the rows of `weight_ih` (4H,
//! I) and `weight_hh` (4H, H) are the gates i, f, g, o in that order, H rows each, and there are two bias vectors (4H).

pub mod fognet;
pub mod gyronet;

use ::gyronet::nn::GATES;

/// Holds the weights of one direction of an LSTM layer, in PyTorch's layout, row-major.
#[derive(Debug, Clone, Copy)]
pub struct LstmWeights<'w> {
    /// (4H, I): weights of the inputs.
    pub weight_ih: &'w [f32],
    /// (4H, H): weights of the hidden state.
    pub weight_hh: &'w [f32],
    pub bias_ih: &'w [f32],
    pub bias_hh: &'w [f32],
}

impl LstmWeights<'_> {
    pub const fn units(&self) -> usize {
        self.bias_ih.len() / GATES
    }
}

/// Runs both directions, forward and backward, over `x` (T, I) from a zero state; returns the hidden states (T, W), those of
/// the backward direction behind those of the forward one. Fewer inputs and units take the first columns. Panics when a
/// slice has another shape.
pub fn bilstm<const I: usize, const H: usize, const W: usize, const T: usize>(
    directions: &[LstmWeights<'_>; 2],
    x: &[[f32; I]; T],
) -> [[f32; W]; T] {
    let mut output = [[0.0; W]; T];
    for (weights, backward) in directions.iter().zip([false, true]) {
        let units = weights.units();
        let offset = if backward { units } else { 0 };
        let [mut h, mut next, mut s] = [[0.0; H]; 3];
        for n in 0..T {
            let t = if backward { T - 1 - n } else { n };
            step(weights, &x[t], &h, &mut s, &mut next);
            h = next;
            output[t][offset..offset + units].copy_from_slice(&h[..units]);
        }
    }
    output
}

/// Computes a step of all units: of input `x` (I), hidden state `h` and cell state `s` (H) the next `h`.
fn step(weights: &LstmWeights<'_>, x: &[f32], h: &[f32], s: &mut [f32], next: &mut [f32]) {
    let units = weights.units();
    let inputs = weights.weight_ih.len() / (GATES * units).max(1);
    for u in 0..units {
        let preactivation = |gate: usize| {
            let row = gate * units + u;
            let (ih, hh) = (row * inputs..(row + 1) * inputs, row * units..(row + 1) * units);
            let input = dense(&weights.weight_ih[ih], weights.bias_ih[row], x);
            input + dense(&weights.weight_hh[hh], weights.bias_hh[row], h)
        };
        let i = sigmoid(preactivation(0)); // Eq. 8
        let f = sigmoid(preactivation(1)); // Eq. 9
        let g = libm::tanhf(preactivation(2)); // Eq. 7
        let o = sigmoid(preactivation(3)); // Eq. 10
        s[u] = g * i + s[u] * f; // Eq. 11
        next[u] = libm::tanhf(s[u]) * o; // Eq. 12
    }
}

/// Computes a fully-connected layer of one output: `weight` (I) and `bias` over `x` (I).
pub fn dense(weight: &[f32], bias: f32, x: &[f32]) -> f32 {
    weight.iter().zip(x).fold(bias, |sum, (w, x)| sum + w * x)
}

pub fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-x))
}
