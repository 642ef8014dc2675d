//! GyroNet in f32, from PyTorch's tensors: the definition that the integer network approximates.

use super::blob::HIDDEN;
use super::{Estimate, WindowNetwork};
use crate::nn::reference::{LstmWeights, dense, lstm};
use crate::units::{AngularRate, SpecificForce};
use crate::window::{FEATURES, Features, WINDOW};

/// GyroNet's tensors, with the names and layouts of the checkpoint.
#[derive(Debug, Clone, Copy)]
pub struct GyroNetF32<'w> {
    /// Mean of each feature, m/s^2 and rad/s.
    pub input_mean: [f32; FEATURES],
    /// Standard deviation of each feature.
    pub input_std: [f32; FEATURES],
    /// rad/s per unit of the last layer.
    pub output_scale: f32,
    /// Layer 1: forward, backward.
    pub lstm1: [LstmWeights<'w>; 2],
    /// Layer 2: forward, backward.
    pub lstm2: [LstmWeights<'w>; 2],
    /// (2H)
    pub fc_weight: &'w [f32],
    /// Scalar.
    pub fc_bias: f32,
}

/// Every layer's output for one window.
#[derive(Debug, Clone)]
pub struct LayerOutputs {
    /// Features less mean, over standard deviation.
    pub normalised: [[f32; FEATURES]; WINDOW],
    /// Hidden states of layer 1, forward then backward.
    pub layer1: [[f32; 2 * HIDDEN]; WINDOW],
    /// Hidden states of layer 2.
    pub layer2: [[f32; 2 * HIDDEN]; WINDOW],
    /// Gyro error, rad/s.
    pub gyro_error: [f32; WINDOW],
}

impl GyroNetF32<'_> {
    /// Runs the network over features in m/s^2 and rad/s.
    #[must_use]
    pub fn layers(&self, window: &[[f32; FEATURES]; WINDOW]) -> LayerOutputs {
        let normalised = window
            .map(|features| core::array::from_fn(|k| (features[k] - self.input_mean[k]) / self.input_std[k]));
        let mut layer1 = [[0.0; 2 * HIDDEN]; WINDOW];
        let mut layer2 = [[0.0; 2 * HIDDEN]; WINDOW];
        for (way, backward) in [false, true].into_iter().enumerate() {
            lstm::<FEATURES, HIDDEN, _>(&self.lstm1[way], &normalised, backward, &mut layer1, way * HIDDEN);
        }
        for (way, backward) in [false, true].into_iter().enumerate() {
            lstm::<_, HIDDEN, _>(&self.lstm2[way], &layer1, backward, &mut layer2, way * HIDDEN);
        }
        let gyro_error = layer2.map(|h| dense(self.fc_weight, self.fc_bias, &h) * self.output_scale);
        LayerOutputs { normalised, layer1, layer2, gyro_error }
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
        let corrections = self.layers(&units).gyro_error.map(|error| {
            // A number that does not fit is as implausible as the largest one that does.
            AngularRate::from_rad_per_sec(error).unwrap_or(AngularRate(i32::MAX))
        });
        Estimate { corrections, clamped_inputs: 0 }
    }
}
