//! This module measures how far the heading drifts while the sensor warms up and the vehicle does not stop. It
//! compares static initialisation, zero-rate updates, the bias curve, and the difference of the rear wheels.

mod drive;
pub mod plot;
mod rear_wheels;
mod rows;

pub use rows::{Outcome, Row, State, run};
