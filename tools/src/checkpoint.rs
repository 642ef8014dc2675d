//! GyroNet's f32 checkpoint, as `tools/train` exports it (safetensors).

use gyronet::model::blob::HIDDEN;
use gyronet::model::gyronet_f32::GyroNetF32;
use gyronet::nn::reference::LstmWeights;
use gyronet::window::FEATURES;
use safetensors::{Dtype, SafeTensors};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not a safetensors file.
    #[error("{name}: not a safetensors file: {source}")]
    Format {
        /// The file.
        name: String,
        /// What the reader said.
        source: safetensors::SafeTensorError,
    },
    /// A tensor that GyroNet needs is not there.
    #[error("{name}: tensor {tensor} is missing")]
    Missing {
        /// The file.
        name: String,
        /// The tensor.
        tensor: &'static str,
    },
    /// A tensor has another shape or element type than GyroNet's.
    #[error("{name}: tensor {tensor} is {found}, should be F32 {expected:?}")]
    Shape {
        /// The file.
        name: String,
        /// The tensor.
        tensor: &'static str,
        /// Type and shape as found.
        found: String,
        /// Shape as needed.
        expected: Vec<usize>,
    },
    /// A tensor holds NaN or an infinity.
    #[error("{name}: tensor {tensor} holds a value that is not finite, at {at}")]
    NotFinite {
        /// The file.
        name: String,
        /// The tensor.
        tensor: &'static str,
        /// Element.
        at: usize,
    },
}

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

/// A checkpoint in memory: every tensor present, of the right shape and finite.
#[derive(Debug, Clone)]
pub struct Checkpoint {
    tensors: BTreeMap<&'static str, Vec<f32>>,
    /// What `tools/train` wrote about its making: JSON, or empty.
    pub provenance: String,
    /// SHA-256 of the file.
    pub sha256: String,
}

impl Checkpoint {
    /// Reads a file.
    ///
    /// # Errors
    /// [`CheckpointError`], which names the file and the tensor.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let bytes =
            std::fs::read(path).map_err(|source| CheckpointError::Io { path: path.to_owned(), source })?;
        Self::parse(&path.display().to_string(), &bytes)
    }

    /// Reads bytes; `name` is for messages.
    ///
    /// # Errors
    /// [`CheckpointError`] with that name.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let format = |source| CheckpointError::Format { name: name.to_owned(), source };
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(format)?;
        let file = SafeTensors::deserialize(bytes).map_err(format)?;
        let provenance =
            header.metadata().as_ref().and_then(|map| map.get("provenance")).cloned().unwrap_or_default();
        let mut tensors = BTreeMap::new();
        for (tensor, shape) in TENSORS {
            let name = || name.to_owned();
            let view = file.tensor(tensor).map_err(|_| CheckpointError::Missing { name: name(), tensor })?;
            if view.dtype() != Dtype::F32 || view.shape() != shape {
                let found = format!("{:?} {:?}", view.dtype(), view.shape());
                return Err(CheckpointError::Shape { name: name(), tensor, found, expected: shape.to_vec() });
            }
            let values: Vec<f32> =
                view.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
            if let Some(at) = values.iter().position(|value| !value.is_finite()) {
                return Err(CheckpointError::NotFinite { name: name(), tensor, at });
            }
            tensors.insert(tensor, values);
        }
        let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { tensors, provenance, sha256 })
    }

    /// The values of one of GyroNet's tensors, row-major.
    ///
    /// # Panics
    /// For a name that is not GyroNet's.
    #[must_use]
    pub fn tensor(&self, name: &str) -> &[f32] {
        self.tensors.get(name).unwrap_or_else(|| panic!("GyroNet has no tensor {name}"))
    }

    /// Weights of layer 1 or 2, forward or backward.
    #[must_use]
    pub fn direction(&self, layer: usize, backward: bool) -> LstmWeights<'_> {
        let tensor = |what: &str| {
            self.tensor(&format!("lstm{layer}.{what}_l0{}", if backward { "_reverse" } else { "" }))
        };
        LstmWeights {
            weight_ih: tensor("weight_ih"),
            weight_hh: tensor("weight_hh"),
            bias_ih: tensor("bias_ih"),
            bias_hh: tensor("bias_hh"),
        }
    }

    /// The f32 network over these tensors.
    #[must_use]
    pub fn network(&self) -> GyroNetF32<'_> {
        let features = |name| std::array::from_fn(|k| self.tensor(name)[k]);
        GyroNetF32 {
            input_mean: features("input_mean"),
            input_std: features("input_std"),
            output_scale: self.tensor("output_scale")[0],
            lstm1: [self.direction(1, false), self.direction(1, true)],
            lstm2: [self.direction(2, false), self.direction(2, true)],
            fc_weight: self.tensor("fc.weight"),
            fc_bias: std::array::from_fn(|row| self.tensor("fc.bias")[row]),
        }
    }
}
