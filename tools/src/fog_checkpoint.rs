//! FoGNet's f32 checkpoint, as `tools/train` exports it.

use crate::tensors::{CheckpointError, Tensors};
use gyronet::model::fognet_blob::{HIDDEN1, HIDDEN2, INPUTS};
use gyronet::model::fognet_f32::FogNetF32;
use gyronet::seconds::STEPS;
use std::path::Path;

/// Tensors and their shapes, as PyTorch names them.
const TENSORS: [(&str, &[usize]); 43] = [
    ("input_mean", &[INPUTS]),
    ("input_std", &[INPUTS]),
    ("correction_scale", &[1]),
    ("lstm1.weight_ih_l0", &[4 * HIDDEN1, INPUTS]),
    ("lstm1.weight_hh_l0", &[4 * HIDDEN1, HIDDEN1]),
    ("lstm1.bias_ih_l0", &[4 * HIDDEN1]),
    ("lstm1.bias_hh_l0", &[4 * HIDDEN1]),
    ("lstm1.weight_ih_l0_reverse", &[4 * HIDDEN1, INPUTS]),
    ("lstm1.weight_hh_l0_reverse", &[4 * HIDDEN1, HIDDEN1]),
    ("lstm1.bias_ih_l0_reverse", &[4 * HIDDEN1]),
    ("lstm1.bias_hh_l0_reverse", &[4 * HIDDEN1]),
    ("lstm1.weight_ih_l1", &[4 * HIDDEN1, 2 * HIDDEN1]),
    ("lstm1.weight_hh_l1", &[4 * HIDDEN1, HIDDEN1]),
    ("lstm1.bias_ih_l1", &[4 * HIDDEN1]),
    ("lstm1.bias_hh_l1", &[4 * HIDDEN1]),
    ("lstm1.weight_ih_l1_reverse", &[4 * HIDDEN1, 2 * HIDDEN1]),
    ("lstm1.weight_hh_l1_reverse", &[4 * HIDDEN1, HIDDEN1]),
    ("lstm1.bias_ih_l1_reverse", &[4 * HIDDEN1]),
    ("lstm1.bias_hh_l1_reverse", &[4 * HIDDEN1]),
    ("lstm2.weight_ih_l0", &[4 * HIDDEN2, 2]),
    ("lstm2.weight_hh_l0", &[4 * HIDDEN2, HIDDEN2]),
    ("lstm2.bias_ih_l0", &[4 * HIDDEN2]),
    ("lstm2.bias_hh_l0", &[4 * HIDDEN2]),
    ("lstm2.weight_ih_l0_reverse", &[4 * HIDDEN2, 2]),
    ("lstm2.weight_hh_l0_reverse", &[4 * HIDDEN2, HIDDEN2]),
    ("lstm2.bias_ih_l0_reverse", &[4 * HIDDEN2]),
    ("lstm2.bias_hh_l0_reverse", &[4 * HIDDEN2]),
    ("lstm2.weight_ih_l1", &[4 * HIDDEN2, 2 * HIDDEN2]),
    ("lstm2.weight_hh_l1", &[4 * HIDDEN2, HIDDEN2]),
    ("lstm2.bias_ih_l1", &[4 * HIDDEN2]),
    ("lstm2.bias_hh_l1", &[4 * HIDDEN2]),
    ("lstm2.weight_ih_l1_reverse", &[4 * HIDDEN2, 2 * HIDDEN2]),
    ("lstm2.weight_hh_l1_reverse", &[4 * HIDDEN2, HIDDEN2]),
    ("lstm2.bias_ih_l1_reverse", &[4 * HIDDEN2]),
    ("lstm2.bias_hh_l1_reverse", &[4 * HIDDEN2]),
    ("fc1.weight", &[1, 2 * HIDDEN1]),
    ("fc1.bias", &[1]),
    ("fc2.weight", &[1, 2 * HIDDEN2]),
    ("fc2.bias", &[1]),
    ("fc3.weight", &[1, STEPS]),
    ("fc3.bias", &[1]),
    ("fc4.weight", &[1, 2]),
    ("fc4.bias", &[1]),
];

/// Whether a checkpoint is FoGNet's, by the tensors in it.
///
/// # Errors
/// [`CheckpointError`], which names the file.
pub fn is_fognet(path: &Path) -> Result<bool, CheckpointError> {
    Tensors::names(path).map(|names| names.iter().any(|name| name == "fc4.weight"))
}

/// A checkpoint in memory.
#[derive(Debug, Clone)]
pub struct FogCheckpoint(Tensors);

impl FogCheckpoint {
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

    /// The f32 network over these tensors.
    #[must_use]
    pub fn network(&self) -> FogNetF32<'_> {
        let features = |name| std::array::from_fn(|k| self.0.tensor(name)[k]);
        let dense = |name: &str| {
            (self.0.tensor(&format!("{name}.weight")), self.0.tensor(&format!("{name}.bias"))[0])
        };
        let lstm =
            |name| [0, 1].map(|layer| [false, true].map(|backward| self.0.direction(name, layer, backward)));
        FogNetF32 {
            input_mean: features("input_mean"),
            input_std: features("input_std"),
            correction_scale: self.0.tensor("correction_scale")[0],
            lstm1: lstm("lstm1"),
            fc1: dense("fc1"),
            lstm2: lstm("lstm2"),
            fc2: dense("fc2"),
            fc3: dense("fc3"),
            fc4: dense("fc4"),
        }
    }
}
