//! Writes FoGNet's weight file. The part that is linear in the gyro's increments is multiplied out in f64
//! and not quantised to int8 ([`gyronet::model::fognet`]); the LSTMs are quantised as GyroNet's.

use super::{QuantizeError, fixed, header, provenance, rows, seal};
use crate::network::checkpoint::{Checkpoint, FogNet};
use crate::network::tensors::Tensors;
use gyronet::model::fognet::GAIN_FRACTION_BITS;
use gyronet::model::fognet_blob::{self, CORRECTION_SHIFT, FogBlob, Gyro, INPUTS, Training};
use gyronet::nn::{HIDDEN_MAX, dense::Dense};
use gyronet::units::{Angle, AngularRate, SpecificForce, WheelSpeed};

/// Standard deviations to which network inputs are clamped. Means over a second have fewer outliers than single
/// samples, and a lower limit leaves more room in the accumulators.
pub const INPUT_CLAMP_STD: f64 = 16.0;

/// Quantises a checkpoint of FoGNet to a weight file.
pub fn quantize(checkpoint: &Checkpoint<FogNet>) -> Result<Vec<u8>, QuantizeError> {
    let clamp = (INPUT_CLAMP_STD * f64::from(HIDDEN_MAX)) as i32;
    let tensors = checkpoint.tensors();
    let scalar = |name| f64::from(tensors.tensor(name)[0]);
    let scale = scalar("correction_scale");
    let [of_f2, of_f3] = [0, 1].map(|k| scale * f64::from(tensors.tensor("fc4.weight")[k]));

    let mut body = Vec::new();
    let lstm = |body: &mut Vec<u8>, name: &str, first: usize| {
        for (layer, input_max) in [(0, clamp), (1, HIDDEN_MAX)] {
            for backward in [false, true] {
                let weights = tensors.direction(name, layer, backward);
                rows::direction(body, &weights, first + layer, input_max)?;
            }
        }
        Ok::<(), QuantizeError>(())
    };
    lstm(&mut body, "lstm1", 1)?;
    let f1 = (tensors.tensor("fc1.weight"), tensors.tensor("fc1.bias")[0]);
    rows::dense(&mut body, "FC1", f1, (f64::from(HIDDEN_MAX), Dense::SHIFT))?;
    lstm(&mut body, "lstm2", 3)?;
    // The bias of FC2 is part of the offset.
    let f2 = (tensors.tensor("fc2.weight"), 0.0);
    rows::dense(&mut body, "FC2", f2, (of_f2 * f64::from(Angle::PER_RAD), CORRECTION_SHIFT))?;

    let training = training(tensors)?;
    let provenance = provenance(tensors);
    let lengths = (fognet_blob::file_len(provenance.len()), provenance.len());
    let force = f64::from(SpecificForce::PER_METRE_PER_SEC2);
    let rate = f64::from(AngularRate::PER_RAD_PER_SEC);
    let way = f64::from(1u32 << WheelSpeed::FRACTION_BITS);
    // The last input is the gyro's increment over one second, so it has the unit of a rate.
    let codes: [f64; INPUTS] = [force, force, force, rate, rate, rate, way, way, rate];
    let mut file = header(tensors, fognet_blob::TOPOLOGY, lengths, clamp, &codes)?;

    let gyro = |name: &str| f64::from(tensors.tensor(name)[INPUTS - 1]);
    let mut of_mean = 0.0;
    for weight in tensors.tensor("fc3.weight") {
        let gain = of_f3 * f64::from(*weight) / gyro("input_std");
        of_mean += gain * gyro("input_mean");
        file.extend(fixed("gain", gain * f64::from(1u32 << GAIN_FRACTION_BITS))?.to_le_bytes());
    }
    let offset =
        of_f2 * scalar("fc2.bias") + of_f3 * scalar("fc3.bias") + scale * scalar("fc4.bias") - of_mean;
    let offset = Angle::from_rad(offset as f32)
        .map_err(|_| QuantizeError::Constant { what: "offset".to_owned(), value: offset })?;
    file.extend(offset.0.to_le_bytes());
    let number = Gyro::ALL.iter().position(|gyro| *gyro == training.gyro).map_or(0, |place| place + 1);
    file.extend((number as u16).to_le_bytes());
    file.extend(u16::from(training.simulated).to_le_bytes());
    file.extend(training.serial.to_le_bytes());
    file.extend(provenance);
    file.extend(body);
    let words = seal(&mut file);
    FogBlob::new_checked(bytemuck::cast_slice(&words))?;
    Ok(file)
}

/// Returns the gyro that the network was trained for, from the provenance.
fn training(tensors: &Tensors) -> Result<Training, QuantizeError> {
    #[derive(serde::Deserialize)]
    struct Found {
        gyro: String,
        serial: u32,
        simulated: bool,
    }
    let Found { gyro, serial, simulated } =
        serde_json::from_str(&tensors.provenance).map_err(|_| QuantizeError::Gyro)?;
    let gyro = Gyro::ALL.into_iter().find(|known| known.to_string() == gyro).ok_or(QuantizeError::Gyro)?;
    Ok(Training { gyro, serial, simulated })
}
