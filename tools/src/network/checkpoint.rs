//! GyroNet's f32 checkpoint, as `tools/train` exports it.

pub use crate::network::tensors::CheckpointError;

use crate::network::tensors::{Shape, Tensors, bilstm, dense, tensor};
use gyronet::model::blob::HIDDEN;
use gyronet::model::gyronet_f32::GyroNetF32;
use gyronet::model::window::FEATURES;
use gyronet::nn::reference::LstmWeights;
use std::path::Path;

/// The network's tensors: two LSTMs one above the other, and what is around them.
fn shapes() -> Vec<Shape> {
    let mut shapes = vec![
        tensor("input_mean", &[FEATURES]),
        tensor("input_std", &[FEATURES]),
        tensor("output_scale", &[1]),
    ];
    shapes.extend(bilstm("lstm1", FEATURES, HIDDEN, 1));
    shapes.extend(bilstm("lstm2", 2 * HIDDEN, HIDDEN, 1));
    shapes.extend(dense("fc", 2 * HIDDEN, 2));
    shapes
}

/// A checkpoint in memory.
#[derive(Debug, Clone)]
pub struct Checkpoint(Tensors);

impl Checkpoint {
    /// Reads a file.
    ///
    /// # Errors
    /// [`CheckpointError`], which names the file and the tensor.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        Tensors::read(path, &shapes()).map(Self)
    }

    /// Reads bytes; `name` is for messages.
    ///
    /// # Errors
    /// [`CheckpointError`] with that name.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, CheckpointError> {
        Tensors::parse(name, bytes, &shapes()).map(Self)
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
