//! Creates window models of any shape with random weights, and windows for them, with the code of the
//! firmware's images.

#[path = "../../src/bin/support/numbers.rs"]
mod numbers;
#[path = "../../src/bin/support/random_model.rs"]
mod random_model;

pub use numbers::Numbers;
pub use random_model::{file, window};
