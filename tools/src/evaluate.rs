//! How good a yaw rate is: each of the [`methods`] on a drive with a reference, measured by [`metrics`] and
//! [`trajectory_error`], tabulated by [`report`]; [`ablation`] switches parts of the compensation off.

pub mod ablation;
pub mod fir;
pub mod methods;
pub mod metrics;
pub mod report;
pub mod trajectory_error;
