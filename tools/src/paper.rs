//! The paper's evaluation: [`sequence`] reads the data sets, [`fog_drive`] runs FoGNet on them, and [`tables`] computes
//! the paper's tables and figures.

pub mod fog_drive;
pub mod sequence;
pub mod tables;
