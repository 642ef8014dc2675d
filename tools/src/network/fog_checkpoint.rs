//! FoGNet's f32 checkpoint, as `tools/train` exports it.

use crate::network::tensors::{CheckpointError, Shape, Tensors, bilstm, dense, tensor};
use gyronet::fog::seconds::STEPS;
use gyronet::model::fognet_blob::{HIDDEN1, HIDDEN2, INPUTS};
use gyronet::model::fognet_f32::FogNetF32;
use std::path::Path;

/// The network's tensors, layer by layer.
fn shapes() -> Vec<Shape> {
    let mut shapes = vec![
        tensor("input_mean", &[INPUTS]),
        tensor("input_std", &[INPUTS]),
        tensor("correction_scale", &[1]),
    ];
    shapes.extend(bilstm("lstm1", INPUTS, HIDDEN1, 2));
    shapes.extend(dense("fc1", 2 * HIDDEN1, 1));
    shapes.extend(bilstm("lstm2", 2, HIDDEN2, 2));
    shapes.extend(dense("fc2", 2 * HIDDEN2, 1));
    shapes.extend(dense("fc3", STEPS, 1));
    shapes.extend(dense("fc4", 2, 1));
    shapes
}

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
