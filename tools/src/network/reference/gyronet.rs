//! Computes GyroNet in f32 from the tensors of training; it defines what the integer network approximates.

use super::{LstmWeights, bilstm, dense};
use gyronet::model::blob::{HIDDEN, LINEAR_INPUTS};
use gyronet::model::{Estimate, FEATURES, Features, WINDOW, WindowNetwork};
use gyronet::units::{AngularRate, SpecificForce};

#[derive(Debug, Clone, Copy)]
pub struct GyroNetF32<'w> {
    /// Mean of each feature, m/s^2 and rad/s.
    pub input_mean: [f32; FEATURES],
    pub input_std: [f32; FEATURES],
    /// (N, N F): weights of each sample's gyro error over all features of the window, if there is a linear part.
    pub linear: Option<&'w [f32]>,
    pub network: Option<NetworkF32<'w>>,
}

#[derive(Debug, Clone, Copy)]
pub struct NetworkF32<'w> {
    /// rad/s per unit of the last layer.
    pub output_scale: f32,
    /// Layer 1: forward, backward.
    pub lstm1: [LstmWeights<'w>; 2],
    pub lstm2: [LstmWeights<'w>; 2],
    /// (1, 2H): the row for the gyro error.
    pub fc_weight: &'w [f32],
    pub fc_bias: f32,
}

/// Holds every layer's output for one window; the places of units that a smaller network lacks are zero.
#[derive(Debug, Clone)]
pub struct LayerOutputs {
    pub normalised: [[f32; FEATURES]; WINDOW],
    /// The linear part of the gyro error, rad/s.
    pub linear: [f32; WINDOW],
    /// Hidden states of layer 1, forward then backward.
    pub layer1: [[f32; 2 * HIDDEN]; WINDOW],
    pub layer2: [[f32; 2 * HIDDEN]; WINDOW],
    pub gyro_error: [f32; WINDOW],
}

impl GyroNetF32<'_> {
    pub fn layers(&self, window: &[[f32; FEATURES]; WINDOW]) -> LayerOutputs {
        let normalised = window
            .map(|features| core::array::from_fn(|k| (features[k] - self.input_mean[k]) / self.input_std[k]));
        let linear = core::array::from_fn(|step| {
            let row = self.linear.map(|weights| &weights[step * LINEAR_INPUTS..(step + 1) * LINEAR_INPUTS]);
            row.map_or(0.0, |row| dense(row, 0.0, window.as_flattened()))
        });
        let (layer1, layer2) = ([[0.0; 2 * HIDDEN]; WINDOW], [[0.0; 2 * HIDDEN]; WINDOW]);
        let mut outputs = LayerOutputs { normalised, linear, layer1, layer2, gyro_error: linear };
        if let Some(network) = &self.network {
            network.run(&mut outputs);
        }
        outputs
    }
}

impl NetworkF32<'_> {
    fn run(&self, outputs: &mut LayerOutputs) {
        let LayerOutputs { normalised, layer1, layer2, gyro_error, .. } = outputs;
        *layer1 = bilstm::<FEATURES, HIDDEN, _, WINDOW>(&self.lstm1, normalised);
        *layer2 = bilstm::<_, HIDDEN, _, WINDOW>(&self.lstm2, layer1);
        for (error, h) in gyro_error.iter_mut().zip(&*layer2) {
            *error += dense(self.fc_weight, self.fc_bias, h) * self.output_scale;
        }
    }
}

impl WindowNetwork for GyroNetF32<'_> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        let units = window.map(|features| {
            core::array::from_fn(|k| {
                let per_unit =
                    if k < 3 { SpecificForce::PER_METRE_PER_SEC2 } else { AngularRate::PER_RAD_PER_SEC };
                features[k] as f32 / per_unit
            })
        });
        let LayerOutputs { linear, gyro_error, .. } = self.layers(&units);
        // A number that does not fit is as implausible as the largest one that fits.
        let code = |rate| AngularRate::from_rad_per_sec(rate).unwrap_or(AngularRate(i32::MAX));
        let (corrections, linear) = (gyro_error.map(code), linear.map(code));
        let linear_sum = linear.iter().map(|part| i64::from(part.0)).sum();
        Estimate { corrections, clamped_inputs: 0, linear_sum }
    }
}
