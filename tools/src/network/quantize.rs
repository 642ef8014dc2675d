//! Quantises an f32 checkpoint to a weight file with int8 rows, packed in the order in which the kernels
//! read.
//!
//! Each gate row has one scale. It is chosen so that the largest weight becomes at most 127 and the multiplier is an
//! integer, which makes the scale itself exact. Rows in the high part of a halfword must not sum to more than 2^23
//! for any input ([`gyronet::nn`]). If they could, the scale is raised until they cannot.

pub mod fognet;
mod rows;

use crate::network::checkpoint::{Checkpoint, GyroNet};
use crate::network::tensors::Tensors;
use gyronet::model::blob::{self, Blob, LINEAR_INPUTS, Topology};
use gyronet::model::fognet_blob::{FOGNET, FOGNET_VERSION};
use gyronet::model::window::FEATURES;
use gyronet::nn::{HIDDEN_MAX, dense::Dense, linear::Linear};
use gyronet::units::{AngularRate, SpecificForce};
use serde_json::json;

/// Standard deviations to which network inputs are clamped.
pub const INPUT_CLAMP_STD: f64 = 24.0;

#[derive(Debug, thiserror::Error, PartialEq)]
pub enum QuantizeError {
    /// A weight of a row is beyond +-3.96, the largest that int8 and a 16-bit multiplier can hold.
    #[error("layer {layer} row {row}: weight {weight} is too large for the int8 format (limit 3.96)")]
    WeightTooLarge {
        /// Layer, 1 or 2; the layers of FoGNet's LSTM2 are 3 and 4.
        layer: usize,
        /// Row in PyTorch's order: gate x units + unit.
        row: usize,
        weight: f64,
    },
    #[error("{what} {value} does not fit its fixed-point field")]
    Constant { what: String, value: f64 },
    #[error(
        "the checkpoint does not name its gyro: train with --gyro, and with --serial if the weights are for one gyro only"
    )]
    Gyro,
    #[error(transparent)]
    Blob(#[from] blob::BlobError),
}

/// Quantises a checkpoint of GyroNet to a weight file.
pub fn quantize(checkpoint: &Checkpoint<GyroNet>) -> Result<Vec<u8>, QuantizeError> {
    let clamp = (INPUT_CLAMP_STD * f64::from(HIDDEN_MAX)) as i32;
    let mut body = Vec::new();
    let (shape, tensors) = (checkpoint.shape(), checkpoint.tensors());
    let force = f64::from(SpecificForce::PER_METRE_PER_SEC2);
    let rate = f64::from(AngularRate::PER_RAD_PER_SEC);
    let codes: [f64; FEATURES] = [force, force, force, rate, rate, rate];
    if let Some(weights) = checkpoint.linear() {
        linear(&mut body, weights, &codes.map(|codes| rate / codes))?;
    }
    if shape.units > 0 {
        for (layer, input_max) in [(1, clamp), (2, HIDDEN_MAX)] {
            for backward in [false, true] {
                let weights = checkpoint.direction(layer, backward);
                rows::direction(&mut body, &weights, layer, input_max)?;
            }
        }
        output(&mut body, tensors)?;
    }
    let provenance = provenance(tensors);
    let lengths = (shape.file_len(provenance.len()), provenance.len());
    let mut file = header(tensors, shape.topology(), lengths, clamp, &codes)?;
    file.extend(provenance);
    file.extend(body);
    let words = seal(&mut file);
    // The file must pass the checks of the firmware.
    Blob::new_checked(bytemuck::cast_slice(&words))?;
    Ok(file)
}

/// Writes the rows of the linear part; `units` converts codes of each feature to rate codes. The cumulative sums of
/// each feature's weights are rounded, from the oldest sample on. So a weight is off by at most an LSB, and weights
/// that cancel for a constant input still cancel.
fn linear(out: &mut Vec<u8>, weights: &[f32], units: &[f64; FEATURES]) -> Result<(), QuantizeError> {
    for row in weights.chunks_exact(LINEAR_INPUTS) {
        let mut sums = [(0.0, 0); FEATURES];
        for sample in row.as_chunks::<FEATURES>().0 {
            for (((exact, rounded), weight), unit) in sums.iter_mut().zip(sample).zip(units) {
                *exact += f64::from(*weight) * unit * f64::from(1u32 << Linear::FRACTION_BITS);
                let next = exact.round();
                let step = fixed("weight of the linear part", next - f64::from(*rounded))?;
                *rounded = fixed("sum of weights of the linear part", next)?;
                out.extend(step.to_le_bytes());
            }
        }
    }
    Ok(())
}

fn output(out: &mut Vec<u8>, tensors: &Tensors) -> Result<(), QuantizeError> {
    let [weight, bias] = ["fc.weight", "fc.bias"].map(|name| tensors.tensor(name));
    let unit = f64::from(tensors.tensor("output_scale")[0]) * f64::from(AngularRate::PER_RAD_PER_SEC);
    rows::dense(out, "gyro error", (weight, bias[0]), (unit, Dense::SHIFT))
}

/// Returns the header that the weight files of all networks share; `codes` are each feature's codes per unit.
fn header(
    tensors: &Tensors,
    [network, sizes @ .., linear]: Topology,
    (file_len, provenance_len): (usize, usize),
    clamp: i32,
    codes: &[f64],
) -> Result<Vec<u8>, QuantizeError> {
    let mut out = blob::MAGIC.to_vec();
    let version = if network == FOGNET { FOGNET_VERSION } else { blob::VERSION };
    out.extend(version.to_le_bytes());
    out.extend(network.to_le_bytes());
    out.extend((file_len as u32).to_le_bytes());
    sizes.iter().for_each(|number| out.extend(number.to_le_bytes()));
    out.extend(u32::from(linear).to_le_bytes());
    out.extend((provenance_len as u32).to_le_bytes());
    out.extend(clamp.to_le_bytes());
    let constants = tensors.tensor("input_mean").iter().zip(tensors.tensor("input_std"));
    for ((mean, std), codes) in constants.zip(codes) {
        out.extend(fixed("input mean", f64::from(*mean) * codes)?.to_le_bytes());
        let multiplier = f64::from(HIDDEN_MAX) / (f64::from(*std) * codes) * f64::from(1u32 << 31);
        out.extend(fixed("input standard deviation", multiplier)?.to_le_bytes());
    }
    Ok(out)
}

/// Appends the checksum to a file; returns the file in words, as the library reads it.
fn seal(file: &mut Vec<u8>) -> Vec<u32> {
    let crc = blob::CRC.checksum(file);
    file.extend(crc.to_le_bytes());
    file.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect()
}

/// Rounds to int32; returns an error if the value does not fit.
fn fixed(what: &str, value: f64) -> Result<i32, QuantizeError> {
    let code = value.round();
    if code.is_finite() && code.abs() < f64::from(i32::MAX) {
        Ok(code as i32)
    } else {
        Err(QuantizeError::Constant { what: what.to_owned(), value })
    }
}

/// Returns the provenance from training and the hash of the checkpoint as JSON, padded to whole words.
fn provenance(tensors: &Tensors) -> Vec<u8> {
    let training = serde_json::from_str(&tensors.provenance).unwrap_or(serde_json::Value::Null);
    let mut text = json!({ "checkpoint_sha256": tensors.sha256, "training": training }).to_string();
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    text.into_bytes()
}
