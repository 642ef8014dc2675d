//! These modules repeat the paper's evaluation: [`sequence`] reads the data sets, [`trajectory`] reads the
//! trajectories of other methods, [`fog_replay`] runs FoGNet, [`tables`] computes the paper's tables and figures, and
//! [`rerun`] runs the complete evaluation, training included.

pub mod fog_replay;
pub mod rerun;
pub mod sequence;
pub mod tables;
pub mod trajectory;
