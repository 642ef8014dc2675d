//! Estimators of the gyro's reading at rest, and the uncertainty of that estimate.
//!
//! `static_init` takes the mean of the first three seconds. `zero_rate` continues whenever the vehicle stands: it
//! estimates the rate that remains after the network, so that the loop is closed around gyro and network together.
//! The wheels show that the vehicle stands. Without wheel speeds, `quiet` checks the inertial sensors, within limits
//! that are tighter than those of the start. `curve` stores the bias by temperature that standstills have shown.
//! `earth` keeps the rotation of the Earth from being subtracted twice.

mod curve;
pub(crate) mod earth;
mod quiet;
mod static_init;
mod zero_rate;

pub use curve::{BiasCurve, CurveBias, CurveFilter};
pub use earth::{EarthRate, Latitude};
pub use quiet::{QuietConfig, QuietDetector};
pub use static_init::{Rest, STATIC_SAMPLES, StaticConfig, StaticError, StaticInit};
pub use zero_rate::{StandstillSource, ZeroRate, ZeroRateConfig, ZeroRateOutcome};
