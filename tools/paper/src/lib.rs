//! The paper's evaluation, on sequences of KAIST Complex Urban.
//!
//! [`sequence`] reads the data sets and [`simulate`] writes simulated sequences in their formats, [`trajectory`] reads
//! the trajectories of other programs, [`fog_replay`] runs FoGNet, and [`tables`] computes the paper's tables.

pub mod fog_replay;
pub mod sequence;
pub mod simulate;
pub mod tables;
pub mod trajectory;
