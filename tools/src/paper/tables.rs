//! These modules make the paper's tables for given sequences, beside the paper's own figures.
//!
//! [`estimates`] makes an [`estimate`] of a sequence by each method, [`given`] takes other programs' trajectories, [`joint`] fits wheels
//! and gyro, [`results`] compares all with the truth and takes means over a [`group`], [`table`] lays them out as the paper's tables, beside its figures ([`paper`]), [`text`]
//! and [`html`] write them, [`pictures`] draws.

pub mod estimate;
pub mod estimates;
pub mod given;
pub mod group;
pub mod html;
pub mod joint;
mod notes;
pub mod paper;
pub mod pictures;
pub mod results;
pub mod table;
pub mod text;

#[cfg(test)]
mod tests;
