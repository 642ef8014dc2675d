//! The f32 checkpoint in flash, for the reference network.
//!
//! A safetensors file is a length (u64), a JSON header and the tensors. The header is searched rather than parsed,
//! which is enough for our own file in a benchmark.

use gyronet::model::gyronet_f32::{GyroNetF32, NetworkF32};
use gyronet::nn::Aligned;
use gyronet::nn::reference::LstmWeights;

const BYTES: &[u8; include_bytes!("../../../tools/weights/gyronet.safetensors").len()] =
    include_bytes!("../../../tools/weights/gyronet.safetensors");
static FILE: Aligned<[u8; BYTES.len()]> = Aligned(*BYTES);

/// Returns the values of a tensor; `None` if the file does not have the tensor in the expected form.
fn tensor(name: &str) -> Option<&'static [f32]> {
    let (len, rest) = FILE.0.split_first_chunk::<8>()?;
    let (header, data) = rest.split_at_checked(u64::from_le_bytes(*len) as usize)?;
    let header = core::str::from_utf8(header).ok()?;
    let (_, entry) = header.split_once(name)?;
    let (_, offsets) = entry.split_once("\"data_offsets\":[")?;
    let (offsets, _) = offsets.split_once(']')?;
    let (from, to) = offsets.split_once(',')?;
    bytemuck::try_cast_slice(data.get(from.parse().ok()?..to.parse().ok()?)?).ok()
}

fn lstm(names: [&str; 4]) -> Option<LstmWeights<'static>> {
    let [weight_ih, weight_hh, bias_ih, bias_hh] = names;
    Some(LstmWeights {
        weight_ih: tensor(weight_ih)?,
        weight_hh: tensor(weight_hh)?,
        bias_ih: tensor(bias_ih)?,
        bias_hh: tensor(bias_hh)?,
    })
}

macro_rules! direction {
    ($layer:literal, $suffix:literal) => {
        lstm([
            concat!("\"lstm", $layer, ".weight_ih_l0", $suffix, "\""),
            concat!("\"lstm", $layer, ".weight_hh_l0", $suffix, "\""),
            concat!("\"lstm", $layer, ".bias_ih_l0", $suffix, "\""),
            concat!("\"lstm", $layer, ".bias_hh_l0", $suffix, "\""),
        ])
    };
}

/// Returns the reference network; `None` if a tensor is missing.
pub fn network() -> Option<GyroNetF32<'static>> {
    Some(GyroNetF32 {
        input_mean: tensor("\"input_mean\"")?.try_into().ok()?,
        input_std: tensor("\"input_std\"")?.try_into().ok()?,
        output_scale: *tensor("\"output_scale\"")?.first()?,
        linear: None,
        network: Some(NetworkF32 {
            lstm1: [direction!("1", "")?, direction!("1", "_reverse")?],
            lstm2: [direction!("2", "")?, direction!("2", "_reverse")?],
            fc_weight: tensor("\"fc.weight\"")?,
            fc_bias: tensor("\"fc.bias\"")?.try_into().ok()?,
        }),
    })
}
