//! Reads the history of a training: the JSON file that `tools/train` writes beside the checkpoint.

use crate::drive::error::{DataError, DataFault};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct History {
    /// The 1 s error of static initialisation on the validation drive, rad.
    pub static_1s_rad: f64,
    /// The seed whose network was kept.
    pub seed: u64,
    pub seeds: BTreeMap<u64, Seed>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Seed {
    /// The best epoch, from 1.
    pub best: usize,
    /// The training time without interruptions, s.
    pub seconds: f64,
    /// The loss of each epoch.
    pub loss: Vec<f64>,
    /// The 1 s error on the validation drive after each epoch, in f32, rad.
    pub mean_1s_rad: Vec<f64>,
}

impl History {
    /// Reads the file.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let shown = path.display();
        let text = std::fs::read(path).map_err(|source| DataError::open(&shown, source))?;
        serde_json::from_slice(&text).map_err(|error| DataError::of(&shown, DataFault::Marker(error)))
    }

    /// Returns the training time of all seeds, s.
    pub fn seconds(&self) -> f64 {
        self.seeds.values().map(|seed| seed.seconds).sum()
    }
}
