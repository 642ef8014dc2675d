//! Each of the [`methods`] is run on a drive with a reference ([`rates`]); [`heading_error`] and [`trajectory_error`]
//! measure its error, [`cost`] its work and delay, and [`report`] tabulates them. [`ablation`] switches parts of the
//! compensation off.

pub mod ablation;
pub mod cost;
pub mod fir;
pub mod heading_error;
pub mod methods;
pub mod metrics;
pub mod rates;
pub mod report;
mod rest;
pub mod trajectory_error;
pub mod vqf;
