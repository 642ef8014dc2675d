//! Writes LSTM directions and output rows in int8 and int16, in the order in which the kernels read them.

use super::{QuantizeError, fixed};
use crate::network::reference::LstmWeights;
use gyronet::nn::lstm::{DirectionWeights, ROW_LIMIT};
use gyronet::nn::{GATES, HIDDEN_FRACTION_BITS, HIDDEN_MAX, pack};

#[derive(Debug, Clone)]
struct Row {
    bias: i32,
    multiplier: i16,
    input: Vec<i8>,
    recurrent: Vec<i8>,
}

/// Writes one direction in reading order ([`gyronet::nn::lstm`]). `layer` is for errors.
pub(super) fn direction(
    out: &mut Vec<u8>,
    weights: &LstmWeights<'_>,
    layer: usize,
    input_max: i32,
) -> Result<(), QuantizeError> {
    let count = weights.bias_ih.len();
    let rows = (0..count)
        .map(|row| quantize_row(weights, layer, row, input_max))
        .collect::<Result<Vec<Row>, _>>()?;
    let units = count / GATES;
    let unit_rows = |unit: usize| std::array::from_fn::<&Row, GATES, _>(|gate| &rows[gate * units + unit]);
    for unit in 0..units {
        let [i, f, g, o] = unit_rows(unit).map(|row| row.bias);
        let packed = |low: i32, high: i32| low.wrapping_add(high.wrapping_mul(256));
        for accumulator in [i, packed(i, f), g, packed(g, o)] {
            out.extend(accumulator.to_le_bytes());
        }
        pack_columns(out, unit_rows(unit).map(|row| row.input.as_slice()));
    }
    for unit in 0..units {
        pack_columns(out, unit_rows(unit).map(|row| row.recurrent.as_slice()));
        let [i, f, g, o] = unit_rows(unit).map(|row| row.multiplier);
        for multipliers in [pack(i, f), pack(g, o)] {
            out.extend(multipliers.to_le_bytes());
        }
    }
    Ok(())
}

fn quantize_row(
    weights: &LstmWeights<'_>,
    layer: usize,
    row: usize,
    input_max: i32,
) -> Result<Row, QuantizeError> {
    let units = weights.bias_ih.len() / GATES;
    let inputs = weights.weight_ih.len() / weights.bias_ih.len();
    let columns = |weights: &[f32], count: usize, padded: usize| {
        let row = weights[row * count..(row + 1) * count].iter().map(|w| f64::from(*w));
        row.chain(std::iter::repeat_n(0.0, padded - count)).collect::<Vec<f64>>()
    };
    let input = columns(weights.weight_ih, inputs, inputs.next_multiple_of(2));
    let recurrent = columns(weights.weight_hh, units, DirectionWeights::padded(units));
    let bias = f64::from(weights.bias_ih[row]) + f64::from(weights.bias_hh[row]);
    let largest = input.iter().chain(&recurrent).fold(0.0f64, |max, w| max.max(w.abs()));
    // Gate input (Q14) = accumulator x multiplier / 2^16, and an accumulator's LSB is
    // scale x 2^-10: multiplier = scale x 2^20.
    let mut multiplier = (largest / 127.0 * f64::from(1 << 20)).ceil().max(1.0);
    loop {
        if multiplier > f64::from(i16::MAX) {
            return Err(QuantizeError::WeightTooLarge { layer, row, weight: largest });
        }
        let scale = multiplier / f64::from(1 << 20);
        let int8 = |values: &[f64]| values.iter().map(|w| (w / scale).round() as i8).collect::<Vec<i8>>();
        // Adding half an LSB of the gate input makes the kernel's shift round to nearest.
        let half = f64::from(1 << 15) / multiplier;
        let bias = bias / scale * f64::from(1 << HIDDEN_FRACTION_BITS) + half;
        let candidate = Row {
            bias: bias.round() as i32,
            multiplier: multiplier as i16,
            input: int8(&input),
            recurrent: int8(&recurrent),
        };
        let sum = |values: &[i8], max: i32| {
            values.iter().map(|w| i64::from(w.unsigned_abs())).sum::<i64>() * i64::from(max)
        };
        let bound = sum(&candidate.input, input_max)
            + sum(&candidate.recurrent, HIDDEN_MAX)
            + i64::from(candidate.bias.unsigned_abs());
        if bound < ROW_LIMIT[row / units] {
            return Ok(candidate);
        }
        multiplier += 1.0;
    }
}

/// Writes pairs of columns: gates (i, f), then (g, o), the second gate of each in the high byte.
fn pack_columns(out: &mut Vec<u8>, [i, f, g, o]: [&[i8]; GATES]) {
    for k in (0..i.len()).step_by(2) {
        for (low, high) in [(i, f), (g, o)] {
            let halfword = |k: usize| i16::from(high[k]) * 256 + i16::from(low[k]);
            out.extend(pack(halfword(k), halfword(k + 1)).to_le_bytes());
        }
    }
}

/// Writes a row of an output layer. An output unit is `codes` codes; the multiplier has `shift` fraction bits.
pub(super) fn dense(
    out: &mut Vec<u8>,
    what: &str,
    (weights, bias): (&[f32], f32),
    (codes, shift): (f64, u32),
) -> Result<(), QuantizeError> {
    let largest = weights.iter().fold(0.0f64, |max, w| max.max(f64::from(w.abs())));
    let sum: f64 = weights.iter().chain([&bias]).map(|w| f64::from(w.abs())).sum();
    // Weights have 14 bits, unless the sum, in units of scale x 2^-10, would need more than 31.
    let scale = (largest / f64::from(1 << 14)).max(1.001 * sum / f64::from(1 << 21)).max(f64::MIN_POSITIVE);
    for weight in weights {
        out.extend(((f64::from(*weight) / scale).round() as i16).to_le_bytes());
    }
    let lsb = scale / f64::from(HIDDEN_MAX);
    out.extend(fixed(&format!("{what}: bias"), f64::from(bias) / lsb)?.to_le_bytes());
    let multiplier = lsb * codes * f64::from(1u32 << shift);
    out.extend(fixed(&format!("{what}: multiplier"), multiplier)?.to_le_bytes());
    Ok(())
}
