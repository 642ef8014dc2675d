//! The paper's tables for given sequences, beside the paper's own results.
//!
//! [`estimates`] computes an estimate of a sequence by each method, [`given`] reads other programs' trajectories,
//! and [`joint`] fits wheels and gyro. [`results`] compares all of them with the truth and averages over a group.
//! [`table`] builds the paper's tables, beside the paper's own results ([`paper`]). [`text`] prints the
//! tables.

pub mod estimates;
pub mod given;
pub mod joint;
mod notes;
pub mod paper;
pub mod results;
pub mod table;
pub mod text;

#[cfg(test)]
mod tests;
