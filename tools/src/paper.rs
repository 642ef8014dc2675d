//! These modules repeat the paper's evaluation: [`sequence`] reads the data sets, [`trajectory`] those of other methods,
//! [`fog_replay`] runs FoGNet, and [`tables`] computes the paper's tables and figures.

pub mod fog_replay;
pub mod sequence;
pub mod tables;
pub mod trajectory;
