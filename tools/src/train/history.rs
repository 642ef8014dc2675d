//! This module reads what a training reported: the JSON file that `tools/train` writes beside the checkpoint.

use crate::drive::error::{DataError, DataFault};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Holds the course of a training.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct History {
    /// Error of static initialisation in 1 s on the validation drive, rad.
    pub static_1s_rad: f64,
    /// The seed whose network was kept.
    pub seed: u64,
    /// The course with each seed.
    pub seeds: BTreeMap<u64, Seed>,
}

/// Holds the course with one seed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Seed {
    /// The best epoch, from 1.
    pub best: usize,
    /// The time that it took, interruptions not counted, s.
    pub seconds: f64,
    /// The loss of each epoch.
    pub loss: Vec<f64>,
    /// The error in 1 s on the validation drive after each epoch, f32, rad.
    pub mean_1s_rad: Vec<f64>,
}

impl History {
    /// Reads the file.
    ///
    /// # Errors
    /// [`DataError`], which names it.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let shown = path.display();
        let text = std::fs::read(path).map_err(|source| DataError::open(&shown, source))?;
        serde_json::from_slice(&text).map_err(|error| DataError::of(&shown, DataFault::Marker(error)))
    }

    /// Returns the time that all seeds took, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seeds.values().map(|seed| seed.seconds).sum()
    }
}
