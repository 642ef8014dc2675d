//! GyroNet's f32 checkpoint, as `tools/train` exports it.

pub use crate::tensors::CheckpointError;

use crate::tensors::Tensors;
use gyronet::model::blob::HIDDEN;
use gyronet::model::gyronet_f32::GyroNetF32;
use gyronet::nn::reference::LstmWeights;
use gyronet::window::FEATURES;
use std::path::Path;

/// Tensors and their shapes, as PyTorch names them.
const TENSORS: [(&str, &[usize]); 21] = [
    ("input_mean", &[FEATURES]),
    ("input_std", &[FEATURES]),
    ("output_scale", &[1]),
    ("lstm1.weight_ih_l0", &[4 * HIDDEN, FEATURES]),
    ("lstm1.weight_hh_l0", &[4 * HIDDEN, HIDDEN]),
    ("lstm1.bias_ih_l0", &[4 * HIDDEN]),
    ("lstm1.bias_hh_l0", &[4 * HIDDEN]),
    ("lstm1.weight_ih_l0_reverse", &[4 * HIDDEN, FEATURES]),
    ("lstm1.weight_hh_l0_reverse", &[4 * HIDDEN, HIDDEN]),
    ("lstm1.bias_ih_l0_reverse", &[4 * HIDDEN]),
    ("lstm1.bias_hh_l0_reverse", &[4 * HIDDEN]),
    ("lstm2.weight_ih_l0", &[4 * HIDDEN, 2 * HIDDEN]),
    ("lstm2.weight_hh_l0", &[4 * HIDDEN, HIDDEN]),
    ("lstm2.bias_ih_l0", &[4 * HIDDEN]),
    ("lstm2.bias_hh_l0", &[4 * HIDDEN]),
    ("lstm2.weight_ih_l0_reverse", &[4 * HIDDEN, 2 * HIDDEN]),
    ("lstm2.weight_hh_l0_reverse", &[4 * HIDDEN, HIDDEN]),
    ("lstm2.bias_ih_l0_reverse", &[4 * HIDDEN]),
    ("lstm2.bias_hh_l0_reverse", &[4 * HIDDEN]),
    ("fc.weight", &[2, 2 * HIDDEN]),
    ("fc.bias", &[2]),
];

/// A checkpoint in memory.
#[derive(Debug, Clone)]
pub struct Checkpoint(Tensors);

impl Checkpoint {
    /// Reads a file.
    ///
    /// # Errors
    /// [`CheckpointError`], which names the file and the tensor.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        Tensors::read(path, &TENSORS).map(Self)
    }

    /// Reads bytes; `name` is for messages.
    ///
    /// # Errors
    /// [`CheckpointError`] with that name.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, CheckpointError> {
        Tensors::parse(name, bytes, &TENSORS).map(Self)
    }

    /// All tensors.
    #[must_use]
    pub fn tensors(&self) -> &Tensors {
        &self.0
    }

    /// Weights of layer 1 or 2, forward or backward.
    #[must_use]
    pub fn direction(&self, layer: usize, backward: bool) -> LstmWeights<'_> {
        self.0.direction(&format!("lstm{layer}"), 0, backward)
    }

    /// The f32 network over these tensors.
    #[must_use]
    pub fn network(&self) -> GyroNetF32<'_> {
        let features = |name| std::array::from_fn(|k| self.0.tensor(name)[k]);
        GyroNetF32 {
            input_mean: features("input_mean"),
            input_std: features("input_std"),
            output_scale: self.0.tensor("output_scale")[0],
            lstm1: [self.direction(1, false), self.direction(1, true)],
            lstm2: [self.direction(2, false), self.direction(2, true)],
            fc_weight: self.0.tensor("fc.weight"),
            fc_bias: std::array::from_fn(|row| self.0.tensor("fc.bias")[row]),
        }
    }
}
