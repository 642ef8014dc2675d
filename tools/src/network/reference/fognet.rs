//! Computes FoGNet in f32 from PyTorch's tensors; it defines what the integer network approximates.

use super::{LstmWeights, bilstm, dense};
use gyronet::model::fognet::{FogEstimate, GAIN_FRACTION_BITS, MinuteNetwork};
use gyronet::model::fognet_blob::{HIDDEN1, HIDDEN2, INPUTS};
use gyronet::model::seconds::{STEPS, SecondsWindow};
use gyronet::units::{Angle, AngularRate, SpecificForce, WheelSpeed};

#[derive(Debug, Clone, Copy)]
pub struct FogNetF32<'w> {
    /// Mean of each feature: m/s^2, rad/s, m, rad.
    pub input_mean: [f32; INPUTS],
    pub input_std: [f32; INPUTS],
    /// rad per unit of the last layer.
    pub correction_scale: f32,
    /// Layer 1, then layer 2; forward, backward.
    pub lstm1: [[LstmWeights<'w>; 2]; 2],
    pub fc1: (&'w [f32], f32),
    pub lstm2: [[LstmWeights<'w>; 2]; 2],
    pub fc2: (&'w [f32], f32),
    pub fc3: (&'w [f32], f32),
    pub fc4: (&'w [f32], f32),
}

#[derive(Debug, Clone)]
pub struct FogLayerOutputs {
    pub normalised: [[f32; INPUTS]; STEPS],
    /// FC1 of LSTM1, in units of the gyro's normalised increments.
    pub f1: [f32; STEPS],
    /// LSTM2's hidden state at the last step, forward then backward.
    pub layer2_last: [f32; 2 * HIDDEN2],
    pub f2: f32,
    pub f3: f32,
    /// The error of the gyro's turn, rad.
    pub correction: f32,
    /// The turn of the vehicle, rad.
    pub prediction: f32,
}

fn two_layers<const I: usize, const H: usize, const W: usize>(
    [first, second]: &[[LstmWeights<'_>; 2]; 2],
    x: &[[f32; I]; STEPS],
) -> [[f32; W]; STEPS] {
    bilstm::<W, H, W, STEPS>(second, &bilstm::<I, H, W, STEPS>(first, x))
}

impl FogNetF32<'_> {
    pub fn layers(&self, window: &[[f32; INPUTS]; STEPS]) -> FogLayerOutputs {
        let normalised = window
            .map(|features| core::array::from_fn(|k| (features[k] - self.input_mean[k]) / self.input_std[k]));
        let gyro = normalised.map(|features| features[INPUTS - 1]);
        let f1 = two_layers::<INPUTS, HIDDEN1, { 2 * HIDDEN1 }>(&self.lstm1, &normalised)
            .map(|hidden| dense(self.fc1.0, self.fc1.1, &hidden));
        let second: [[f32; 2]; STEPS] = core::array::from_fn(|step| [f1[step], gyro[step]]);
        let [.., layer2_last] = two_layers::<2, HIDDEN2, { 2 * HIDDEN2 }>(&self.lstm2, &second);
        let f2 = dense(self.fc2.0, self.fc2.1, &layer2_last);
        let f3 = dense(self.fc3.0, self.fc3.1, &gyro);
        let correction = dense(self.fc4.0, self.fc4.1, &[f2, f3]) * self.correction_scale;
        let turn: f32 = window.iter().map(|features| features[INPUTS - 1]).sum();
        FogLayerOutputs { normalised, f1, layer2_last, f2, f3, correction, prediction: turn - correction }
    }

    /// Returns the gain that FC3, FC4 and the scales give a step's increment: rad of correction per rad.
    fn gain(&self, step: usize) -> f32 {
        self.correction_scale * self.fc4.0[1] * self.fc3.0[step] / self.input_std[INPUTS - 1]
    }
}

impl MinuteNetwork for FogNetF32<'_> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        let mut features = [[0.0; INPUTS]; STEPS];
        let mut linear = 0.0;
        for ((step, second), row) in window.iter().enumerate().zip(&mut features) {
            let [fx, fy, fz, rx, ry, rz, left, right] = second.features.map(|code| code as f32);
            let force = [fx, fy, fz].map(|code| code / SpecificForce::PER_METRE_PER_SEC2);
            let rate = [rx, ry, rz].map(|code| code / AngularRate::PER_RAD_PER_SEC);
            let distance = [left, right].map(|code| code / (1u32 << WheelSpeed::FRACTION_BITS) as f32);
            let turn = second.turn.rad() as f32;
            let all = force.into_iter().chain(rate).chain(distance).chain([turn]);
            row.iter_mut().zip(all).for_each(|(to, value)| *to = value);
            linear += self.gain(step) * turn;
        }
        let correction = self.layers(&features).correction;
        let mean_gain = (0..STEPS).map(|step| self.gain(step)).sum::<f32>() / STEPS as f32;
        // A number that does not fit is as implausible as the largest one that fits.
        let angle = |rad| Angle::from_rad(rad).unwrap_or(Angle(i64::MAX));
        FogEstimate {
            correction: angle(correction),
            linear: angle(linear),
            gain: libm::roundf(mean_gain * (1u32 << GAIN_FRACTION_BITS) as f32) as i32,
            clamped_inputs: 0,
        }
    }
}
