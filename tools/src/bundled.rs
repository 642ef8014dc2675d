//! What comes inside the binary, so that it works from anywhere: the simulated drive and the
//! f32 checkpoint of the default weights.

use crate::checkpoint::{Checkpoint, CheckpointError};
use crate::recording::{Recording, RecordingError};

/// What `gyronet simulate --seconds 90 --seed 1` writes.
pub const SIMULATED_DRIVE: &str = include_str!("../data/simulated_drive.csv");

/// The checkpoint that [`gyronet::model::weights::DEFAULT`] was made from.
const CHECKPOINT: &[u8] = include_bytes!("../weights/gyronet.safetensors");

/// The simulated drive.
///
/// # Errors
/// Never, unless the repository is broken.
pub fn simulated_drive() -> Result<Recording, RecordingError> {
    Recording::parse("simulated_drive.csv", SIMULATED_DRIVE.as_bytes())
}

/// The f32 checkpoint.
///
/// # Errors
/// Never, unless the repository is broken.
pub fn checkpoint() -> Result<Checkpoint, CheckpointError> {
    Checkpoint::parse("gyronet.safetensors", CHECKPOINT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Config, csv};

    #[test]
    fn simulated_drive_is_what_simulate_writes() {
        let mut bytes = Vec::new();
        csv::write(&Config { seconds: 90, seed: 1, ..Config::DEFAULT }, &mut bytes).unwrap();
        assert!(
            bytes == SIMULATED_DRIVE.as_bytes(),
            "run: gyronet simulate --out tools/data/simulated_drive.csv"
        );
    }

    #[test]
    fn everything_bundled_is_usable() {
        assert_eq!(simulated_drive().unwrap().rows.len(), 9_000);
        checkpoint().unwrap();
    }

    #[test]
    fn weights_are_what_quantize_makes() {
        let (bytes, _) = crate::quantize::quantize(&checkpoint().unwrap()).unwrap();
        assert!(bytes == gyronet::model::weights::DEFAULT.0, "run: gyronet quantize");
    }
}
