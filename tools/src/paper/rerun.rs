//! These modules run the paper's complete evaluation. [`split`] finds the sequences and splits them as the paper
//! does, [`plan`] lists the steps from files to tables, [`run`] runs the steps that have no [`marker`] of being
//! finished, and [`report`] lists what was computed, what is missing, and what was left out.

pub mod marker;
pub mod plan;
pub mod report;
pub mod run;
pub mod split;

#[cfg(test)]
mod tests;
