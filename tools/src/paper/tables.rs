//! The paper's tables for the sequences at hand, beside what the paper prints.
//!
//! [`methods`] makes headings of a sequence, [`results`] compares them with the truth and takes
//! means, [`table`] lays them out as the paper's tables, beside its figures ([`paper`]), [`text`]
//! and [`html`] write them, [`pictures`] draws.

pub mod html;
pub mod methods;
pub mod paper;
pub mod pictures;
pub mod results;
pub mod table;
pub mod text;

#[cfg(test)]
mod tests;
