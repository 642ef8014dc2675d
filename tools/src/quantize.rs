//! f32 checkpoint to weight file: int8 rows, packed in the order in which the kernels read.
//!
//! A gate row gets one scale, chosen so that its largest weight becomes at most 127 and its
//! multiplier is a whole number: the scale itself is then exact. Rows that share a halfword as
//! the high part must not sum to more than 2^23 for any input ([`gyronet::nn`]); where the
//! largest-weight scale would allow that, the scale is raised until it does not.

use crate::checkpoint::Checkpoint;
use gyronet::model::blob::{self, Blob, HIDDEN};
use gyronet::nn::lstm::ROW_LIMIT;
use gyronet::nn::reference::LstmWeights;
use gyronet::nn::{GATES, HIDDEN_FRACTION_BITS, HIDDEN_MAX, dense::Dense, exp2, pack};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet::window::{FEATURES, WINDOW};
use serde_json::json;

/// Network inputs are clamped to this many standard deviations; `gyronet quantize --drives` says
/// how many that hits.
pub const INPUT_CLAMP_STD: f64 = 24.0;

/// Why a checkpoint cannot be quantised.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum QuantizeError {
    /// A row's weights are beyond +-3.96, the largest that int8 and a 16-bit multiplier hold.
    #[error("layer {layer} row {row}: weight {weight} is too large for the int8 format (limit 3.96)")]
    WeightTooLarge {
        /// 1 or 2.
        layer: usize,
        /// PyTorch's row: gate x 60 + unit.
        row: usize,
        /// The largest weight.
        weight: f64,
    },
    /// A normalisation constant does not fit its fixed-point field.
    #[error("{what} {value} does not fit its fixed-point field")]
    Constant {
        /// Which one.
        what: String,
        /// Its value.
        value: f64,
    },
    /// The result does not pass the library's own checks.
    #[error(transparent)]
    Blob(#[from] blob::BlobError),
}

/// One quantised gate row.
#[derive(Debug, Clone)]
struct Row {
    bias: i32,
    multiplier: i16,
    input: Vec<i8>,
    recurrent: Vec<i8>,
}

/// What quantisation did.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Rows in all.
    pub rows: usize,
    /// Rows whose scale was raised to keep their sum inside 24 bits.
    pub raised: usize,
    /// Largest factor by which one was raised.
    pub largest_raise: f64,
    /// Bytes of the file.
    pub bytes: usize,
}

/// Makes a weight file.
///
/// # Errors
/// [`QuantizeError`].
pub fn quantize(checkpoint: &Checkpoint) -> Result<(Vec<u8>, Report), QuantizeError> {
    let mut report = Report { largest_raise: 1.0, ..Report::default() };
    let clamp = (INPUT_CLAMP_STD * f64::from(HIDDEN_MAX)) as i32;
    let mut body = Vec::new();
    for (layer, inputs, input_max) in [(1, FEATURES, clamp), (2, 2 * HIDDEN, HIDDEN_MAX)] {
        for backward in [false, true] {
            let weights = checkpoint.direction(layer, backward);
            let rows = (0..GATES * HIDDEN)
                .map(|row| quantize_row(&weights, layer, row, inputs, input_max, &mut report))
                .collect::<Result<Vec<Row>, _>>()?;
            pack_direction(&mut body, &rows);
        }
    }
    output(&mut body, checkpoint)?;
    let provenance = provenance(checkpoint);
    let mut file = header(checkpoint, provenance.len(), clamp)?;
    file.extend(provenance);
    file.extend(body);
    let crc = blob::CRC.checksum(&file);
    file.extend(crc.to_le_bytes());
    report.bytes = file.len();
    // The file must pass the very checks that the firmware makes.
    let words: Vec<u32> = file.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    Blob::new_checked(bytemuck::cast_slice(&words))?;
    Ok((file, report))
}

fn quantize_row(
    weights: &LstmWeights<'_>,
    layer: usize,
    row: usize,
    inputs: usize,
    input_max: i32,
    report: &mut Report,
) -> Result<Row, QuantizeError> {
    let input: Vec<f64> = (0..inputs).map(|k| weights.weight_ih[row * inputs + k].into()).collect();
    let recurrent: Vec<f64> = (0..HIDDEN).map(|k| weights.weight_hh[row * HIDDEN + k].into()).collect();
    let bias = f64::from(weights.bias_ih[row]) + f64::from(weights.bias_hh[row]);
    let largest = input.iter().chain(&recurrent).fold(0.0f64, |max, w| max.max(w.abs()));
    // Gate input (Q14) = accumulator x multiplier / 2^16, and an accumulator's LSB is
    // scale x 2^-10: multiplier = scale x 2^20.
    let first = (largest / 127.0 * f64::from(1 << 20)).ceil().max(1.0);
    let mut multiplier = first;
    loop {
        if multiplier > f64::from(i16::MAX) {
            return Err(QuantizeError::WeightTooLarge { layer, row, weight: largest });
        }
        let scale = multiplier / f64::from(1 << 20);
        let int8 = |values: &[f64]| values.iter().map(|w| (w / scale).round() as i8).collect::<Vec<i8>>();
        // Half an LSB of the gate input makes the kernel's shift round to nearest.
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
        if bound < ROW_LIMIT[row / HIDDEN] {
            report.rows += 1;
            report.raised += usize::from(multiplier > first);
            report.largest_raise = report.largest_raise.max(multiplier / first);
            return Ok(candidate);
        }
        multiplier += 1.0;
    }
}

/// Writes one direction in reading order ([`gyronet::nn::lstm`]).
fn pack_direction(out: &mut Vec<u8>, rows: &[Row]) {
    let unit_rows = |unit: usize| std::array::from_fn::<&Row, GATES, _>(|gate| &rows[gate * HIDDEN + unit]);
    for unit in 0..HIDDEN {
        let [i, f, g, o] = unit_rows(unit).map(|row| row.bias);
        let packed = |low: i32, high: i32| low.wrapping_add(high.wrapping_mul(256));
        for accumulator in [i, packed(i, f), g, packed(g, o)] {
            out.extend(accumulator.to_le_bytes());
        }
        pack_columns(out, unit_rows(unit).map(|row| row.input.as_slice()));
    }
    for unit in 0..HIDDEN {
        pack_columns(out, unit_rows(unit).map(|row| row.recurrent.as_slice()));
        let [i, f, g, o] = unit_rows(unit).map(|row| row.multiplier);
        for multipliers in [pack(i, f), pack(g, o)] {
            out.extend(multipliers.to_le_bytes());
        }
    }
}

/// Pairs of columns: gates (i, f), then (g, o), the second gate of each in the high byte.
fn pack_columns(out: &mut Vec<u8>, [i, f, g, o]: [&[i8]; GATES]) {
    for k in (0..i.len()).step_by(2) {
        for (low, high) in [(i, f), (g, o)] {
            let halfword = |k: usize| i16::from(high[k]) * 256 + i16::from(low[k]);
            out.extend(pack(halfword(k), halfword(k + 1)).to_le_bytes());
        }
    }
}

/// Both rows of the output layer.
fn output(out: &mut Vec<u8>, checkpoint: &Checkpoint) -> Result<(), QuantizeError> {
    let (error, log_scale) = checkpoint.tensor("fc.weight").split_at(2 * HIDDEN);
    let bias = checkpoint.tensor("fc.bias");
    let unit = f64::from(checkpoint.tensor("output_scale")[0]) * f64::from(AngularRate::PER_RAD_PER_SEC);
    dense(out, "gyro error", error, bias[0], unit)?;
    // The sum over the window is the mean of the logs.
    let log2 = f64::from(1 << exp2::FRACTION_BITS) * std::f64::consts::LOG2_E / WINDOW as f64;
    dense(out, "log of the scale", log_scale, bias[1], log2)?;
    out.extend(fixed("output scale", unit)?.to_le_bytes());
    Ok(())
}

/// One row of the output layer; `codes` of its output make one unit.
fn dense(out: &mut Vec<u8>, what: &str, weights: &[f32], bias: f32, codes: f64) -> Result<(), QuantizeError> {
    let largest = weights.iter().fold(0.0f64, |max, w| max.max(f64::from(w.abs())));
    let sum: f64 = weights.iter().chain([&bias]).map(|w| f64::from(w.abs())).sum();
    // Weights of 14 bits, unless the sum, in units of scale x 2^-10, would pass 31.
    let scale = (largest / f64::from(1 << 14)).max(1.001 * sum / f64::from(1 << 21)).max(f64::MIN_POSITIVE);
    for weight in weights {
        out.extend(((f64::from(*weight) / scale).round() as i16).to_le_bytes());
    }
    let lsb = scale / f64::from(HIDDEN_MAX);
    out.extend(fixed(&format!("{what}: bias"), f64::from(bias) / lsb)?.to_le_bytes());
    let multiplier = lsb * codes * f64::from(1u32 << Dense::SHIFT);
    out.extend(fixed(&format!("{what}: multiplier"), multiplier)?.to_le_bytes());
    Ok(())
}

fn header(checkpoint: &Checkpoint, provenance: usize, clamp: i32) -> Result<Vec<u8>, QuantizeError> {
    let mut out = blob::MAGIC.to_vec();
    out.extend(blob::VERSION.to_le_bytes());
    out.extend(blob::GYRONET.to_le_bytes());
    out.extend((blob::file_len(provenance) as u32).to_le_bytes());
    for shape in [WINDOW, FEATURES, HIDDEN, 2] {
        out.extend((shape as u16).to_le_bytes());
    }
    out.extend((provenance as u32).to_le_bytes());
    out.extend(clamp.to_le_bytes());
    for feature in 0..FEATURES {
        let per_unit =
            if feature < 3 { SpecificForce::PER_METRE_PER_SEC2 } else { AngularRate::PER_RAD_PER_SEC };
        let per_unit = f64::from(per_unit);
        let mean = f64::from(checkpoint.tensor("input_mean")[feature]);
        let std = f64::from(checkpoint.tensor("input_std")[feature]);
        out.extend(fixed("input mean", mean * per_unit)?.to_le_bytes());
        let multiplier = f64::from(HIDDEN_MAX) / (std * per_unit) * f64::from(1u32 << 31);
        out.extend(fixed("input standard deviation", multiplier)?.to_le_bytes());
    }
    Ok(out)
}

/// Rounds to int32; refuses what does not fit.
fn fixed(what: &str, value: f64) -> Result<i32, QuantizeError> {
    let code = value.round();
    if code.is_finite() && code.abs() < f64::from(i32::MAX) {
        Ok(code as i32)
    } else {
        Err(QuantizeError::Constant { what: what.to_owned(), value })
    }
}

/// Training's provenance and the checkpoint's hash, padded to whole words.
fn provenance(checkpoint: &Checkpoint) -> Vec<u8> {
    let training = serde_json::from_str(&checkpoint.provenance).unwrap_or(serde_json::Value::Null);
    let mut text = json!({ "checkpoint_sha256": checkpoint.sha256, "training": training }).to_string();
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    text.into_bytes()
}
