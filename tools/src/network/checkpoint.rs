//! Reads the f32 checkpoints of GyroNet and FoGNet that `gyronet_train` exports.

use super::reference::LstmWeights;
use super::reference::fognet::FogNetF32;
use super::reference::gyronet::{GyroNetF32, NetworkF32};
use super::tensors::{Found, Shape, Tensors, bilstm, dense, tensor};
use crate::drive::error::{DataError, read};
use gyronet::model::blob::{self, HIDDEN, LINEAR_INPUTS};
use gyronet::model::fognet_blob::{HIDDEN1, HIDDEN2, INPUTS};
use gyronet::model::seconds::STEPS;
use gyronet::model::window::{FEATURES, WINDOW};
use std::marker::PhantomData;
use std::path::Path;

pub trait Network {
    /// Returns the names and shapes of the network's tensors; `found` gives the shapes in the file, from which
    /// variable sizes are taken.
    fn shapes(found: Found<'_>) -> Vec<Shape>;
}

/// GyroNet: a linear part, or two stacked Bi-LSTMs and a fully connected layer, or both.
#[derive(Debug, Clone)]
pub struct GyroNet;

/// FoGNet: two stacks of Bi-LSTMs and four fully connected layers.
#[derive(Debug, Clone)]
pub struct FogNet;

impl Network for GyroNet {
    fn shapes(found: Found<'_>) -> Vec<Shape> {
        let mut shapes = vec![tensor("input_mean", &[FEATURES]), tensor("input_std", &[FEATURES])];
        let linear = found(LINEAR).is_some();
        if linear {
            shapes.push(tensor(LINEAR, &[WINDOW, LINEAR_INPUTS]));
        }
        let units = match found("lstm1.weight_hh_l0") {
            Some(shape) => shape.last().map_or(HIDDEN, |units| (*units).min(HIDDEN)),
            None if linear => return shapes,
            None => HIDDEN,
        };
        shapes.push(tensor("output_scale", &[1]));
        shapes.extend(bilstm("lstm1", FEATURES, units, 1));
        shapes.extend(bilstm("lstm2", 2 * units, units, 1));
        shapes.extend(dense("fc", 2 * units, 1));
        shapes
    }
}

impl Network for FogNet {
    fn shapes(_found: Found<'_>) -> Vec<Shape> {
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
}

#[derive(Debug, Clone)]
pub struct Checkpoint<N> {
    tensors: Tensors,
    network: PhantomData<N>,
}

impl<N: Network> Checkpoint<N> {
    pub fn read(path: &Path) -> Result<Self, DataError> {
        Self::parse(&path.display().to_string(), &read(path)?)
    }

    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, DataError> {
        Ok(Self { tensors: Tensors::parse(name, bytes, N::shapes)?, network: PhantomData })
    }

    pub fn tensors(&self) -> &Tensors {
        &self.tensors
    }

    fn features<const F: usize>(&self, name: &str) -> [f32; F] {
        std::array::from_fn(|k| self.tensors.tensor(name)[k])
    }
}

const LINEAR: &str = "linear.weight";

impl Checkpoint<GyroNet> {
    /// Returns the shape of the network: the units of the Bi-LSTMs, and whether it has a linear part.
    pub fn shape(&self) -> blob::Shape {
        let units = self.bilstms().map_or(0, |network| network.lstm1[0].units());
        blob::Shape { units: units as u16, linear: self.linear().is_some() }
    }

    pub fn linear(&self) -> Option<&[f32]> {
        self.tensors.has(LINEAR).then(|| self.tensors.tensor(LINEAR))
    }

    fn bilstms(&self) -> Option<NetworkF32<'_>> {
        self.tensors.has("fc.weight").then(|| NetworkF32 {
            output_scale: self.tensors.tensor("output_scale")[0],
            lstm1: [self.direction(1, false), self.direction(1, true)],
            lstm2: [self.direction(2, false), self.direction(2, true)],
            fc_weight: self.tensors.tensor("fc.weight"),
            fc_bias: self.tensors.tensor("fc.bias")[0],
        })
    }

    /// Returns the weights of layer 1 or 2, forward or backward.
    pub fn direction(&self, layer: usize, backward: bool) -> LstmWeights<'_> {
        self.tensors.direction(&format!("lstm{layer}"), 0, backward)
    }

    pub fn network(&self) -> GyroNetF32<'_> {
        GyroNetF32 {
            input_mean: self.features("input_mean"),
            input_std: self.features("input_std"),
            linear: self.linear(),
            network: self.bilstms(),
        }
    }
}

impl Checkpoint<FogNet> {
    pub fn network(&self) -> FogNetF32<'_> {
        let dense = |name: &str| {
            let [weight, bias] =
                ["weight", "bias"].map(|what| self.tensors.tensor(&format!("{name}.{what}")));
            (weight, bias[0])
        };
        let lstm = |name| {
            [0, 1].map(|layer| [false, true].map(|backward| self.tensors.direction(name, layer, backward)))
        };
        FogNetF32 {
            input_mean: self.features("input_mean"),
            input_std: self.features("input_std"),
            correction_scale: self.tensors.tensor("correction_scale")[0],
            lstm1: lstm("lstm1"),
            fc1: dense("fc1"),
            lstm2: lstm("lstm2"),
            fc2: dense("fc2"),
            fc3: dense("fc3"),
            fc4: dense("fc4"),
        }
    }
}
