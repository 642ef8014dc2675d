//! These modules run the paper's whole evaluation: [`split`] finds the sequences and splits them as the paper does,
//! [`plan`] lists the steps from files to tables, [`run`] runs those that [`marker`] does not find finished, and [`report`]
//! says what was made, what is missing, and what was left out.

pub mod marker;
pub mod plan;
pub mod report;
pub mod run;
pub mod split;

#[cfg(test)]
mod tests;
