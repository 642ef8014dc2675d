//! These modules repeat the paper's evaluation: [`sequence`] reads the data sets, [`fog_replay`] runs FoGNet on them,
//! and [`tables`] computes the paper's tables and figures.

pub mod fog_replay;
pub mod sequence;
pub mod tables;
