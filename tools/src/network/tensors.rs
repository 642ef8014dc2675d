//! Reads a checkpoint file (safetensors) and checks that a network's tensors exist, fit and are
//! finite.

use super::reference::LstmWeights;
use crate::drive::error::DataError;
use safetensors::{Dtype, SafeTensors};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// Name and shape of a tensor, as in PyTorch.
pub type Shape = (String, Vec<usize>);

/// A function that returns the shape of a tensor in the file, if the file has it.
pub type Found<'f> = &'f dyn Fn(&str) -> Option<Vec<usize>>;

/// Returns the name and shape of one tensor: a vector, or a matrix in row-major order.
pub(crate) fn tensor(name: &str, shape: &[usize]) -> Shape {
    (name.to_owned(), shape.to_vec())
}

/// Returns the tensors of a bidirectional LSTM with `units` in each direction. The rows of gates i, f, g and o follow
/// each other; the input of a higher layer is both directions of the layer below.
pub(crate) fn bilstm(name: &str, inputs: usize, units: usize, layers: usize) -> Vec<Shape> {
    let directions = (0..layers).flat_map(|layer| ["", "_reverse"].map(|direction| (layer, direction)));
    let tensors = directions.flat_map(|(layer, direction)| {
        let inputs = if layer == 0 { inputs } else { 2 * units };
        let shape =
            |what: &str, shape: &[usize]| tensor(&format!("{name}.{what}_l{layer}{direction}"), shape);
        [
            shape("weight_ih", &[4 * units, inputs]),
            shape("weight_hh", &[4 * units, units]),
            shape("bias_ih", &[4 * units]),
            shape("bias_hh", &[4 * units]),
        ]
    });
    tensors.collect()
}

pub(crate) fn dense(name: &str, inputs: usize, outputs: usize) -> [Shape; 2] {
    [tensor(&format!("{name}.weight"), &[outputs, inputs]), tensor(&format!("{name}.bias"), &[outputs])]
}

#[derive(Debug, Clone)]
pub struct Tensors {
    tensors: BTreeMap<String, Vec<f32>>,
    /// The provenance that `gyronet_train` wrote: JSON, or empty.
    pub provenance: String,
    pub sha256: String,
}

impl Tensors {
    pub(crate) fn parse(
        name: &str,
        bytes: &[u8],
        shapes: fn(Found<'_>) -> Vec<Shape>,
    ) -> Result<Self, DataError> {
        let refused = |reason: String| DataError::because(name, reason);
        let format = |error| refused(format!("not a safetensors file: {error}"));
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(format)?;
        let file = SafeTensors::deserialize(bytes).map_err(format)?;
        let provenance =
            header.metadata().as_ref().and_then(|map| map.get("provenance")).cloned().unwrap_or_default();
        let mut views: BTreeMap<_, _> = file.iter().collect();
        let mut tensors = BTreeMap::new();
        for (tensor, shape) in shapes(&|tensor| views.get(tensor).map(|view| view.shape().to_vec())) {
            let view = views.remove(tensor.as_str());
            let view = view.ok_or_else(|| refused(format!("tensor {tensor} is missing")))?;
            let (kind, found) = (view.dtype(), view.shape());
            if kind != Dtype::F32 || found != shape {
                let reason = format!("tensor {tensor} is {kind:?} {found:?}, should be F32 {shape:?}");
                return Err(refused(reason));
            }
            let values: Vec<f32> =
                view.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
            if let Some(at) = values.iter().position(|value| !value.is_finite()) {
                return Err(refused(format!("tensor {tensor} holds a value that is not finite, at {at}")));
            }
            tensors.insert(tensor, values);
        }
        if !views.is_empty() {
            let unused = views.into_keys().collect::<Vec<_>>().join(", ");
            return Err(refused(format!("the network has no {unused}: quantising would leave them out")));
        }
        let sha256 = format!("{:x}", Sha256::digest(bytes));
        Ok(Self { tensors, provenance, sha256 })
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.tensors.contains_key(name)
    }

    /// Returns the values of a tensor, row-major.
    ///
    /// # Panics
    /// If the network has no tensor of this name.
    pub fn tensor(&self, name: &str) -> &[f32] {
        self.tensors.get(name).unwrap_or_else(|| panic!("the network has no tensor {name}"))
    }

    pub(crate) fn direction(&self, lstm: &str, layer: usize, backward: bool) -> LstmWeights<'_> {
        let tensor = |what: &str| {
            self.tensor(&format!("{lstm}.{what}_l{layer}{}", if backward { "_reverse" } else { "" }))
        };
        LstmWeights {
            weight_ih: tensor("weight_ih"),
            weight_hh: tensor("weight_hh"),
            bias_ih: tensor("bias_ih"),
            bias_hh: tensor("bias_hh"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::tensor::TensorView;

    /// A file of tensors with two numbers each.
    fn file(names: &[&str]) -> Vec<u8> {
        let data = [0u8; 8];
        let view = |name: &&str| ((*name).to_owned(), TensorView::new(Dtype::F32, vec![2], &data).unwrap());
        safetensors::serialize(names.iter().map(view), None).unwrap()
    }

    fn error(bytes: &[u8]) -> String {
        Tensors::parse("net", bytes, |_| vec![tensor("a", &[2])]).unwrap_err().to_string()
    }

    #[test]
    fn every_tensor_of_a_file_is_used_or_named() {
        let unused = error(&file(&["a", "lstm1.weight_ih_l1", "lstm1.weight_hh_l1"]));
        assert!(unused.contains("no lstm1.weight_hh_l1, lstm1.weight_ih_l1:"), "{unused}");
        assert_eq!(error(&file(&["b"])), "net: tensor a is missing");
    }
}
