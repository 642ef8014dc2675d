//! Data built into the binary, so that it runs from any folder: the simulated drive and the f32 checkpoint of GyroNet.

use crate::drive::error::DataError;
use crate::drive::stream::Recording;
use crate::network::checkpoint::{Checkpoint, GyroNet};
use crate::simulate::{Config, csv, gnss};

/// The drive that `gyronet simulate --seconds 90 --seed 1` writes.
pub const SIMULATED_DRIVE: &str = include_str!("../data/simulated_drive.csv");

const CHECKPOINT: &[u8] = include_bytes!("../weights/gyronet.safetensors");

pub fn simulated_drive() -> Result<Recording, DataError> {
    Recording::parse("simulated_drive.csv", SIMULATED_DRIVE.as_bytes())
}

/// Length of the drive of `gyronet demo`, s.
pub const DEMO_SECONDS: u32 = 600;

/// Returns the drive of `gyronet demo`: ten minutes of the same vehicle (`gyronet simulate --seconds 600 --seed 1`),
/// with or without courses that arrive after half a second (`--gnss 0.5`).
pub fn demo_drive(with_gnss: bool) -> Result<Recording, DataError> {
    let gnss = with_gnss.then_some(gnss::Config { latency_s: 0.5, spoofed_from_s: None });
    let config = Config { seconds: DEMO_SECONDS, seed: 1, gnss, ..Config::DEFAULT };
    let mut bytes = Vec::new();
    csv::write(&config, &mut bytes).expect("a vector takes all bytes");
    Recording::parse("simulated_drive.csv", &bytes[..])
}

pub fn checkpoint() -> Result<Checkpoint<GyroNet>, DataError> {
    Checkpoint::parse("gyronet.safetensors", CHECKPOINT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

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
    fn weights_are_what_quantize_makes() {
        let bytes = crate::network::quantize::quantize(&checkpoint().unwrap()).unwrap();
        assert!(bytes == gyronet::model::weights::GYRONET.0, "run: gyronet quantize");
        let weights = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights");
        let default = Checkpoint::read(&weights.join("default.safetensors")).unwrap();
        let bytes = crate::network::quantize::quantize(&default).unwrap();
        assert!(bytes == gyronet::model::weights::DEFAULT.0, "run: gyronet quantize");
        let fognet = Checkpoint::read(&weights.join("fognet.safetensors")).unwrap();
        let bytes = crate::network::quantize::fognet::quantize(&fognet).unwrap();
        assert!(bytes == gyronet::model::weights::FOGNET.0, "run: gyronet quantize");
    }
}
