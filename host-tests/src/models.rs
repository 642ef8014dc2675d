//! Window models of any shape with random weights, windows for them, and hashes of outputs: the code of the images.

#[path = "../../src/bin/support/hashes.rs"]
pub mod hashes;
#[path = "../../src/bin/support/numbers.rs"]
mod numbers;
#[path = "../../src/bin/support/random_model.rs"]
mod random_model;

use gyronet::model::{Blob, GyroNet, weights};
pub use numbers::Numbers;
pub use random_model::{file, window};

/// The paper's network with the weights of the library.
pub fn gyronet() -> GyroNet<'static> {
    GyroNet::new(Blob::new_checked(&weights::GYRONET.0).expect("they come with the library"))
}
