//! Each of the [`methods`] is run on a drive with a reference; [`metrics`] and [`trajectory_error`] measure its error,
//! and [`report`] tabulates it. [`ablation`] switches parts of the compensation off.

pub mod ablation;
pub mod fir;
pub mod methods;
pub mod metrics;
pub mod report;
pub mod trajectory_error;
