//! Sigmoid and tanh are tables of straight lines, one word per segment.
//!
//! The input is a gate's Q14 value, saturated to 18 bits (+-8); the output is Q15 in the upper half of a word, for the
//! cell update's halfword multiplies. An entry holds the line's base in its upper half and the slope in its lower one:
//! `entry + slope * fraction`, one load and one multiply-accumulate. (The table allows for what the slope adds to the
//! base.) Each line is the chord of its segment moved by half the sagitta.
//!
//! | function | segments | table | largest error over all 262,144 inputs (test `activation_error`) |
//! |---|---|---|---|
//! | sigmoid | 256 of 1/16 | 1 KiB | 5.4e-5 (1.75 LSB) |
//! | tanh | 512 of 1/32 | 2 KiB | 7.6e-5 (2.5 LSB) |

use super::GATE_FRACTION_BITS;

pub const INPUT_BITS: u32 = 18;
const INPUT_MAX: i32 = (1 << (INPUT_BITS - 1)) - 1;
const INPUT_MIN: i32 = -(1 << (INPUT_BITS - 1));

pub const SIGMOID_SHIFT: u32 = 10;
pub const TANH_SHIFT: u32 = 9;
/// The tanh slope, four times the sigmoid's, is stored divided by four, and the fraction multiplied by four.
pub const TANH_FRACTION_SCALE: u32 = 2;
const SIGMOID_LEN: usize = 1 << (INPUT_BITS - SIGMOID_SHIFT);
const TANH_LEN: usize = 1 << (INPUT_BITS - TANH_SHIFT);

/// The table holds the lines of the sigmoid; entry 128 starts at input 0.
pub static SIGMOID: [i32; SIGMOID_LEN] = table(false, SIGMOID_SHIFT, 0);
/// The table holds the lines of the tanh; entry 256 starts at input 0.
pub static TANH: [i32; TANH_LEN] = table(true, TANH_SHIFT, TANH_FRACTION_SCALE);

/// Clamps a gate input to the tables' range, +-8 in Q14.
#[inline]
pub fn saturate(x: i32) -> i32 {
    x.clamp(INPUT_MIN, INPUT_MAX)
}

/// Returns the sigmoid of a saturated Q14 input. The upper half of the result is Q15.
#[inline]
pub fn sigmoid(x: i32) -> i32 {
    let entry = SIGMOID[((x >> SIGMOID_SHIFT) + SIGMOID_LEN as i32 / 2) as usize & (SIGMOID_LEN - 1)];
    let fraction = x & ((1 << SIGMOID_SHIFT) - 1);
    entry + i32::from(entry as i16) * fraction
}

/// Returns the hyperbolic tangent of a saturated Q14 input. The upper half of the result is Q15.
#[inline]
pub fn tanh(x: i32) -> i32 {
    let entry = TANH[((x >> TANH_SHIFT) + TANH_LEN as i32 / 2) as usize & (TANH_LEN - 1)];
    let fraction = (x & ((1 << TANH_SHIFT) - 1)) << TANH_FRACTION_SCALE;
    entry + i32::from(entry as i16) * fraction
}

const fn table<const LEN: usize>(is_tanh: bool, shift: u32, fraction_scale: u32) -> [i32; LEN] {
    let mut lines = [0; LEN];
    let width = (1u32 << shift) as f64 / (1u32 << GATE_FRACTION_BITS) as f64;
    let mut k = 0;
    while k < LEN {
        let from = (k as f64 - (LEN / 2) as f64) * width;
        let (a, mid, b) = if is_tanh {
            (tanh_f64(from), tanh_f64(from + width / 2.0), tanh_f64(from + width))
        } else {
            (sigmoid_f64(from), sigmoid_f64(from + width / 2.0), sigmoid_f64(from + width))
        };
        let q31 = (1u64 << 31) as f64;
        let slope = floor((b - a) * q31 / (1u64 << (shift + fraction_scale)) as f64 + 0.5);
        // Half the sagitta shares the error; half an LSB makes the final shift round; the slope
        // in the lower half counts too.
        let base = (a + (mid - (a + b) / 2.0) / 2.0) * q31 + 32768.0 - slope;
        let base = floor(base / 65536.0 + 0.5);
        // Neither the base nor the end of the line may leave the 16 bits.
        let top = if base > 32767.0 { 32767.0 } else { base };
        lines[k] = (top as i32) << 16 | slope as i32;
        k += 1;
    }
    lines
}

/// Rounds towards minus infinity, for values that fit 64 bits.
const fn floor(x: f64) -> f64 {
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
}

/// Computes e^x at compile time: the series on x / 2^10, squared ten times; good to 1e-12 for |x| <= 16.
const fn exp(x: f64) -> f64 {
    let small = x / 1024.0;
    let (mut term, mut sum, mut n) = (1.0, 1.0, 1.0);
    while n < 9.0 {
        term *= small / n;
        sum += term;
        n += 1.0;
    }
    let mut k = 0;
    while k < 10 {
        sum *= sum;
        k += 1;
    }
    sum
}

const fn sigmoid_f64(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}

const fn tanh_f64(x: f64) -> f64 {
    2.0 * sigmoid_f64(2.0 * x) - 1.0
}
