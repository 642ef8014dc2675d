//! These modules make the paper's tables for given sequences, beside the paper's own figures.
//!
//! [`estimates`] makes headings of a sequence, [`given`] takes other programs' trajectories, [`results`] compares them
//! with the truth and takes means, [`table`] lays them out as the paper's tables, beside its figures ([`paper`]), [`text`]
//! and [`html`] write them, [`pictures`] draws.

pub mod estimates;
pub mod given;
pub mod html;
mod notes;
pub mod paper;
pub mod pictures;
pub mod results;
pub mod table;
pub mod text;

#[cfg(test)]
mod tests;
